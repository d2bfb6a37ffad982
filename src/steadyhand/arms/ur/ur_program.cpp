#include "steadyhand/arms/ur/ur_program.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace steadyhand {

namespace {

/// Nine digits, so that the next one takes as much room.
constexpr std::int32_t kFirstSession = 100000001, kLastSession = 999999999;

// Comparisons are written so that NaN fails them. URScript has neither constants nor early ends of loops
// worth using: `ended` says why the loop ends. Speeds are means over the cycle that begins, as servoj makes them, and
// after a cycle that was carried on only the way back is taken: where a plan's acceleration jumped meanwhile, so would
// the speed. A thread has a share of the cycle, and loses the next one if it takes more: what a usual cycle evaluates
// is kept short (tests count it), and lists are added as wholes.
constexpr const char* kProgram = R"(def steadyhand():
  step = get_steptime()
  rate = 1.0 / step
  most = [{most}]
  bridged = {bridged}
  longest_wait = {timeout} / step
  brake = {braking} * step
  still = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
  q = get_target_joint_positions()
  dq = still
  place = q
  speed = still
  cycle = 0
  answered = 0
  late = 0
  youngest = 1000000
  following = False
  returning = True
  ended = 0
  write_output_integer_register({owner}, {session})
  write_output_integer_register({state}, 1)
  textmsg("steadyhand: ready")
  while ended == 0:
    cycle = cycle + 1
    write_output_integer_register({cycle}, cycle)
    was = place
    moved = speed
    place = get_target_joint_positions()
    speed = get_target_joint_speeds()
    if not (norm(place - was - (moved + speed) * (0.5 * step)) <= {jump}):
      ended = -5
    elif not (norm(speed - moved) <= {swerve}):
      ended = -5
    elif norm(moved) > {halt}:
      if norm(speed) < 0.0001:
        ended = -5
      end
    end
    if read_input_integer_register({input_session}) == {session}:
      answers = read_input_integer_register({answers})
      if answers > answered:
        if answers <= cycle:
          if not following:
            following = True
            write_output_integer_register({state}, 2)
            if not (norm({read_q} - q) <= {start_tolerance}):
              ended = -4
            end
          end
          answered = answers
          if cycle - answered < youngest:
            youngest = cycle - answered
          end
        end
      end
      if following:
        if read_input_integer_register({mode}) == 0:
          ended = -1
        end
      end
    end
    if following and ended == 0:
      lost = cycle - answered - youngest
      if lost <= bridged:
        late = 0
      else:
        late = late + 1
      end
      if late + bridged > longest_wait:
        ended = -2
      elif late > 0:
        returning = True
        i = 0
        while i < 6:
          if dq[i] > brake:
            dq[i] = dq[i] - brake
          elif dq[i] < -brake:
            dq[i] = dq[i] + brake
          else:
            dq[i] = 0.0
          end
          i = i + 1
        end
        q = q + dq * step
      elif lost > 0 or returning:
        t = lost * step
        ddq = {read_ddq}
        goal_dq = {read_dq} + ddq * t
        goal = {read_q} + (goal_dq - ddq * (0.5 * t)) * t
        goal_dq = goal_dq - ddq * (0.5 * step)
        behind = goal - goal_dq * step - q
        change = goal_dq + behind * 20.0 - dq
        returning = lost > 0 or norm(behind) > 0.00001 or norm(goal_dq - dq) > {slip}
        i = 0
        while i < 6:
          if not (norm(behind[i]) <= {return_tolerance}):
            ended = -4
          elif norm(change[i]) > most[i]:
            if change[i] > 0.0:
              change[i] = most[i]
            else:
              change[i] = -most[i]
            end
          end
          i = i + 1
        end
        dq = dq + change
        q = q + dq * step
      else:
        goal = {read_q}
        dq = (goal - q) * rate
        q = goal
        if not ({too_fast}):
          ended = -3
        end
      end
      if ended == 0:
        servoj(q, t=step, lookahead_time={lookahead}, gain={gain})
      end
    elif ended == 0:
      if cycle > {first_wait} / step:
        ended = -2
      end
      sync()
    end
  end
  stopj({braking})
  write_output_integer_register({state}, ended)
  textmsg("steadyhand: ended, ", ended)
end
)";

}  // namespace

std::string make_ur_program(const UrProgramSettings& s) {
  using R = UrRegisters;
  const double step = s.step;
  const auto list = [](const JointVector& values, double times) {
    std::vector<std::string> texts;
    for (const double value : values) texts.push_back(fmt::format("{:.6f}", times * value));
    return fmt::format("{}", fmt::join(texts, ", "));
  };
  const auto read = [](int first) {
    std::vector<std::string> calls;
    for (int i = 0; i < 6; ++i) calls.push_back(fmt::format("read_input_float_register({})", first + i));
    return fmt::format("[{}]", fmt::join(calls, ", "));
  };
  std::vector<std::string> fast;
  for (int i = 0; i < 6; ++i) fast.push_back(fmt::format("norm(dq[{}]) <= {:.4f}", i, 1.1 * s.velocity_max[i]));
  // If RTDE reports only some cycles, set-points of the others are not lost. The hundredth is for rounding.
  std::string bridged = fmt::format("{}.01", s.bridged);
  if (s.state_period > 0.0) bridged += fmt::format(" + {:.4f} / step - 1.0", s.state_period);
  // The hardest that the target's speed changes in a cycle when all goes well, and the way of two cycles at full speed,
  // as one cycle may be lost.
  const double hardest = s.rejoin * s.acceleration_max.norm() * step;
  return fmt::format(
      fmt::runtime(kProgram), fmt::arg("most", list(s.acceleration_max, s.rejoin * step)),
      fmt::arg("too_fast", fmt::format("{}", fmt::join(fast, " and "))), fmt::arg("bridged", bridged),
      fmt::arg("timeout", s.timeout), fmt::arg("braking", s.braking), fmt::arg("owner", R::kOwner),
      fmt::arg("session", s.session), fmt::arg("state", R::kState), fmt::arg("cycle", R::kCycle),
      fmt::arg("input_session", R::kSession), fmt::arg("answers", R::kAnswers), fmt::arg("mode", R::kMode),
      fmt::arg("start_tolerance", s.start_tolerance), fmt::arg("return_tolerance", s.return_tolerance),
      fmt::arg("read_q", read(R::kQ)), fmt::arg("read_dq", read(R::kDq)), fmt::arg("read_ddq", read(R::kDdq)),
      fmt::arg("lookahead", s.lookahead), fmt::arg("gain", s.gain), fmt::arg("first_wait", s.first_wait),
      fmt::arg("slip", 0.2 * s.rejoin * s.acceleration_max.minCoeff() * step), fmt::arg("swerve", 3.0 * hardest),
      fmt::arg("halt", hardest), fmt::arg("jump", 2.0 * s.velocity_max.norm() * step));
}

UrProgramText::UrProgramText(UrProgramSettings settings) : session_(kFirstSession) {
  settings.session = session_;
  text_ = std::string(kUrStopProgram) + make_ur_program(settings);
  const std::string digits = std::to_string(kFirstSession);
  session_at_[0] = text_.find(digits);
  session_at_[1] = text_.find(digits, session_at_[0] + 1);
}

void UrProgramText::renew(int newest) {
  newest = std::max(newest, session_);
  session_ = newest >= kFirstSession && newest < kLastSession ? newest + 1 : kFirstSession;
  for (const std::size_t at : session_at_) {
    int rest = session_;
    for (int digit = 8; digit >= 0; --digit, rest /= 10) text_[at + digit] = static_cast<char>('0' + rest % 10);
  }
}

}  // namespace steadyhand
