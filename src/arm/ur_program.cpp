#include "arm/ur_program.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace steadyhand {

namespace {

// Comparisons are such that what is not a number fails them. URScript has neither constants nor early ends of loops
// worth using: `ended` says why the loop ends. Speeds are means over the cycle that begins, as servoj makes them, and
// after a cycle that was carried on only the way back is taken: where a plan's acceleration jumped meanwhile, so would
// the speed. A list times a number, and sums of lists, are not in every software version, so that joints are counted.
constexpr const char* kProgram = R"(def steadyhand():
  step = get_steptime()
  fastest = [{velocities}]
  rejoin = [{rejoin}]
  bridged = {bridged}
  patience = {timeout} / step
  brake = {braking} * step

  q = get_target_joint_positions()
  dq = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
  goal = q
  goal_dq = dq
  behind = dq
  cycle = 0
  heard = 0
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
    if read_input_integer_register({input_session}) == {session}:
      answers = read_input_integer_register({answers})
      if answers > heard:
        if answers <= cycle:
          if not following:
            following = True
            write_output_integer_register({state}, 2)
            limit = {start_tolerance}
            i = 0
            while i < 6:
              if not (norm(read_input_float_register({q} + i) - q[i]) <= limit):
                ended = -4
              end
              i = i + 1
            end
          end
          heard = answers
          if cycle - heard < youngest:
            youngest = cycle - heard
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
      lost = cycle - heard - youngest
      if lost <= bridged:
        late = 0
      else:
        late = late + 1
      end
      if late + bridged > patience:
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
          q[i] = q[i] + dq[i] * step
          i = i + 1
        end
      else:
        if lost > 0:
          returning = True
        end
        t = lost * step
        i = 0
        away = 0.0
        slip = 0.0
        while i < 6:
          ddq = read_input_float_register({ddq} + i)
          goal_dq[i] = read_input_float_register({dq} + i) + ddq * t
          goal[i] = read_input_float_register({q} + i) + (goal_dq[i] - 0.5 * ddq * t) * t
          goal_dq[i] = goal_dq[i] - 0.5 * ddq * step
          behind[i] = goal[i] - goal_dq[i] * step - q[i]
          if not (norm(behind[i]) <= away):
            away = norm(behind[i])
          end
          if norm(goal_dq[i] - dq[i]) > slip * rejoin[i] * step:
            slip = norm(goal_dq[i] - dq[i]) / (rejoin[i] * step)
          end
          i = i + 1
        end
        i = 0
        if returning:
          if not (away <= {return_tolerance}):
            ended = -4
          elif away < 0.00001:
            if slip < 0.2:
              returning = lost > 0
            end
          end
          while i < 6:
            most = rejoin[i] * step
            change = goal_dq[i] + 20.0 * behind[i] - dq[i]
            if change > most:
              change = most
            elif change < -most:
              change = -most
            end
            dq[i] = dq[i] + change
            q[i] = q[i] + dq[i] * step
            i = i + 1
          end
        else:
          while i < 6:
            dq[i] = (goal[i] - q[i]) / step
            if not (norm(dq[i]) <= fastest[i]):
              ended = -3
            end
            i = i + 1
          end
          if ended == 0:
            q = goal
          end
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
  const auto list = [](const JointVector& values, double times) {
    std::vector<std::string> texts;
    for (const double value : values) texts.push_back(fmt::format("{:.4f}", times * value));
    return fmt::format("{}", fmt::join(texts, ", "));
  };
  // Where RTDE tells of some cycles only, set-points of the others are not lost. The hundredth is for rounding.
  std::string bridged = fmt::format("{}.01", s.bridged);
  if (s.state_period > 0.0) bridged += fmt::format(" + {:.4f} / step - 1.0", s.state_period);
  return fmt::format(fmt::runtime(kProgram), fmt::arg("velocities", list(s.velocity_max, 1.1)),
                     fmt::arg("rejoin", list(s.acceleration_max, s.rejoin)), fmt::arg("bridged", bridged),
                     fmt::arg("timeout", s.timeout), fmt::arg("braking", s.braking), fmt::arg("owner", R::kOwner),
                     fmt::arg("session", s.session), fmt::arg("state", R::kState), fmt::arg("cycle", R::kCycle),
                     fmt::arg("input_session", R::kSession), fmt::arg("answers", R::kAnswers),
                     fmt::arg("mode", R::kMode), fmt::arg("start_tolerance", s.start_tolerance),
                     fmt::arg("return_tolerance", s.return_tolerance), fmt::arg("q", R::kQ), fmt::arg("dq", R::kDq),
                     fmt::arg("ddq", R::kDdq), fmt::arg("lookahead", s.lookahead), fmt::arg("gain", s.gain),
                     fmt::arg("first_wait", s.first_wait));
}

}  // namespace steadyhand
