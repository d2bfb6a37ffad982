#include "steadyhand/arms/ur/ur_arm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

constexpr double kStanding = 0.01;   ///< rad/s, measured, below which an arm counts as standing
constexpr int kQuiet = 10;           ///< states without a new cycle of the program, after which it counts as gone
constexpr double kEnding = 0.3;      ///< s
constexpr double kFullSpeed = 0.99;  ///< share of the speed that counts as all of it

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Formatted into `place`, as much as it holds.
template <typename... Arguments>
std::string_view words(std::span<char> place, fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  const auto end = fmt::format_to_n(place.data(), place.size(), text, std::forward<Arguments>(arguments)...).out;
  return {place.data(), static_cast<std::size_t>(end - place.data())};
}

UrProgramSettings program_of(const UrSettings& settings, const RobotModel& model, const RtdeClient& client) {
  UrProgramSettings program = settings.program;
  program.step = 1.0 / client.controller().rate_hz();
  program.velocity_max = model.velocity_max;
  program.acceleration_max = model.acceleration_max;
  program.state_period = 1.0 / client.rate_hz();
  return program;
}

}  // namespace

Result<std::unique_ptr<UniversalRobotsArm>> UniversalRobotsArm::connect(const RobotModel& model, const UrSettings& s,
                                                                        Clock& clock) {
  const auto to = [s](std::uint16_t port) {
    return [s, port] { return Socket::connect(s.host, port, from_seconds(s.connect_timeout)); };
  };
  auto arm = over(to(s.rtde_port), to(s.script_port), model, s, clock);
  if (!arm) return arm;
  // That the script port is there, too, is said before anything moves.
  if (const auto script = (*arm)->connections_.dial_script(); !script) {
    return Error{script.error().message +
                 "; enable the primary interface at the pendant: Settings, Security, Services"};
  }
  if (model.tool().gripper_time && s.gripper_port != 0) {
    auto gripper = RobotiqGripper::connect(to(s.gripper_port), s.gripper);
    if (!gripper) {
      return Error{gripper.error().message + "; its URCap must be installed, or leave it alone with --gripper-port 0"};
    }
    (*arm)->take_gripper(*std::move(gripper));
  }
  (*arm)->connections_.start_thread();
  return arm;
}

Result<std::unique_ptr<UniversalRobotsArm>> UniversalRobotsArm::over(Dial rtde, Dial script, const RobotModel& model,
                                                                     const UrSettings& s, Clock& clock) {
  if (model.dof() != 6) return Error{fmt::format("robot '{}' has {} joints; a UR has 6", model.name, model.dof())};
  auto client = UrConnections::open(rtde, s.connect_timeout);
  if (!client) return client.error();
  const ControllerVersion& v = (*client)->controller();
  if ((v.major == 3 && std::pair(v.minor, v.bugfix) < std::pair(14u, 3u)) || v.major < 3 || v.major == 4 ||
      (v.major == 5 && std::pair(v.minor, v.bugfix) < std::pair(9u, 4u))) {
    return Error{fmt::format("the controller's software is {}.{}.{}; its programs need 3.14.3 (CB3) or 5.9.4 at least",
                             v.major, v.minor, v.bugfix)};
  }
  std::unique_ptr<UniversalRobotsArm> arm(
      new UniversalRobotsArm(model, s, clock, std::move(rtde), std::move(script), *std::move(client)));
  if (!arm->rtde_) return Error{"the controller closed the RTDE connection"};
  return arm;
}

UniversalRobotsArm::UniversalRobotsArm(const RobotModel& model, const UrSettings& settings, Clock& clock, Dial rtde,
                                       Dial script, std::unique_ptr<RtdeClient> first)
    : model_(&model),
      settings_(settings),
      clock_(&clock),
      version_(first->controller()),
      protocol_(first->protocol()),
      program_(program_of(settings, model, *first)),
      connections_(std::move(rtde), std::move(script), settings.connect_timeout),
      rtde_(std::move(first)),
      check_(model) {
  info_ = {fmt::format("{} (Universal Robots, software {}.{}.{})", model.name, version_.major, version_.minor,
                       version_.bugfix),
           6, rtde_->rate_hz(), settings.delay};
  period_ = from_seconds(1.0 / info_.rate_hz);
  carry_on_ = {settings.program.bridged / info_.rate_hz, JointVector::Constant(6, settings.program.braking)};
  state_.joints = {{clock.now(), clock.now()}, model.home, JointVector::Zero(6)};
  // The joints' position and the running program are to be known before the first cycle.
  for (int i = 0; i < 50 && !known_ && rtde_ && rtde_->wait(period_); ++i) known_ = listen();
  known_ = false;
}

UniversalRobotsArm::~UniversalRobotsArm() {
  if (rtde_) stop("the program ends");
}

void UniversalRobotsArm::take_gripper(std::unique_ptr<RobotiqGripper> gripper) {
  gripper_ = std::move(gripper);
  info_.gripper[0] = true;
  state_.joints.gripper[0] = gripper_->position();
}

// ---------------------------------------------------------------------------------------------- connections

void UniversalRobotsArm::lose_connection() {
  stop("the connection to the controller was lost");
  connections_.replace(std::move(rtde_));
  known_ = false;
}

/// Takes in all that has come. @return whether there was a report
bool UniversalRobotsArm::listen() {
  bool received = false;
  for (;;) {
    const Socket::Outcome outcome = rtde_->fill();
    for (RtdeReader data({}); rtde_->next(data); received = true) read(data);
    if (outcome == Socket::Outcome::kDone) continue;
    if (outcome == Socket::Outcome::kClosed) lose_connection();
    return received;
  }
}

void UniversalRobotsArm::read(RtdeReader& data) {
  const std::int32_t cycle = report_.cycle;
  report_.read(data);
  quiet_ = report_.cycle == cycle ? quiet_ + 1 : 0;
  for (int i = 0; i < 6; ++i) {
    state_.joints.q[i] = report_.q[i];
    state_.joints.dq[i] = report_.dq[i];
  }
}

/// Reads why the program that was sent did not start, or ended. Ignores other messages.
void UniversalRobotsArm::read_script() {
  while (primary_) {
    const Socket::Outcome outcome = primary_->fill();
    for (UrMessage message; primary_->next(message);) {
      if (!message.serious() || phase_ < Phase::kUploading || phase_ > Phase::kFollowing) continue;
      const std::string_view text = message.text.substr(0, 120);
      if (message.code == kUrReadOnly) {
        stop(
            "the controller accepts no programs from here (C210): switch it to remote control with the pendant, then "
            "reset");
      } else if (message.kind == UrMessage::Kind::kException) {
        stop(words(next_words(), "runtime error on the controller, line {}: {}", message.line, text));
      } else {
        stop(words(next_words(), "error C{}A{} of the controller: {}", message.code, message.argument, text));
      }
    }
    if (outcome == Socket::Outcome::kDone) continue;
    if (outcome == Socket::Outcome::kClosed) connections_.end(std::move(primary_));
    return;
  }
}

// ---------------------------------------------------------------------------------------------- the control thread

ArmState UniversalRobotsArm::receive() {
  if (!rtde_ && (rtde_ = connections_.take_rtde())) known_ = silent_ = false;
  bool received = false;
  if (rtde_) {
    received = listen();
    if (rtde_ && !received && rtde_->wait(silent_ ? period_ : from_seconds(settings_.state_timeout)))
      received = listen();
  }
  if (received) {
    silent_ = false;
    keep_time();
  } else {
    // Before it follows nothing moves, and missing states are only a delay: while we send nothing, TCP may hold states
    // back for some 40 ms (Nagle's algorithm there, late acknowledgements here).
    const bool idle = phase_ < Phase::kFollowing;
    if (rtde_ && (!silent_ || idle)) {
      silent_ = true;
      if (!idle || long_ago(settings_.start_within)) stop("no message from the controller");
    }
    keep_time_alone();
  }
  read_script();
  if (gripper_) state_.joints.gripper[0] = gripper_->position();
  if (rtde_ && received) proceed();
  state_.status = phase_ == Phase::kFollowing ? ArmStatus::kFollowing
                  : phase_ == Phase::kStopped ? ArmStatus::kStopped
                                              : ArmStatus::kStarting;
  if (phase_ != Phase::kStopped) state_.reason = {};
  tell_what_was_carried_on();
  return state_;
}

/// In cycles that we missed, the program bridged by itself, and braked. It can return to any set-point near by;
/// commands that continue from its present set-point need no return.
void UniversalRobotsArm::tell_what_was_carried_on() {
  state_.carried_on.reset();
  const Time without = state_.joints.stamp.made - period_ - last_command_.stamp.made;
  if (phase_ != Phase::kFollowing || last_command_.q.size() == 0 || without < period_ / 2) return;
  state_.carried_on = steadyhand::carried_on(last_command_, to_seconds(without), carry_on_);
}

/// Counts cycles by the controller's clock, and brings its stamp to ours.
void UniversalRobotsArm::keep_time() {
  const bool sane = std::isfinite(report_.timestamp) && std::abs(report_.timestamp) < 1e9;
  const Time timestamp = sane ? from_seconds(report_.timestamp) : last_timestamp_;
  const Time passed = timestamp - last_timestamp_;
  const Time last = state_.joints.stamp.made;
  if (!known_ || passed <= Time(0) || passed > std::chrono::seconds(10)) {
    offset_.reset();
    ++state_.cycle;
  } else {
    state_.cycle += static_cast<std::uint64_t>(std::max<Time::rep>(1, (passed + period_ / 2) / period_));
  }
  known_ = true;
  last_timestamp_ = timestamp;
  const Time made = std::max(offset_.update(timestamp, clock_->now(), phase_ != Phase::kFollowing), last + Time(1));
  state_.joints.stamp = {made, made};
}

/// Without the controller: a cycle a period, by our clock.
void UniversalRobotsArm::keep_time_alone() {
  const Time last = state_.joints.stamp.made;
  clock_->sleep_until(last + period_);
  const Time made = std::max(clock_->now(), last + period_);
  state_.cycle += static_cast<std::uint64_t>((made - last) / period_);
  state_.joints.stamp = {made, made};
  state_.joints.dq.setZero();
  known_ = false;
}

bool UniversalRobotsArm::program_is_ours() const {
  return ours() && report_.playing() && report_.program >= UrProgramState::kReady && quiet_ < kQuiet;
}

/// The phase has lasted for longer than that.
bool UniversalRobotsArm::long_ago(double seconds) const {
  return static_cast<double>(state_.cycle - phase_since_) > seconds * info_.rate_hz;
}

/// Changes the phase by the controller's report.
void UniversalRobotsArm::proceed() {
  if (phase_ == Phase::kStopped) {
    if (!ours() || report_.program < UrProgramState::kReady) return;
    send_input(nullptr);
    // A safety stop only pauses the program: without this, the next press of "play" would resume it.
    if (report_.runtime == UrRuntime::kPaused && primary_ && !std::exchange(asked_to_stop_, true)) {
      std::size_t sent = 0;
      (void)primary_->send(bytes_of(kUrStopProgram), sent);
    }
    return;
  }
  if (const std::string_view why = why_not(report_.safety); !why.empty()) return stop(why);
  if (const std::string_view why = why_not(report_.mode); !why.empty()) return stop(why);
  if (!state_.joints.q.allFinite() || !state_.joints.dq.allFinite()) return stop("the robot reports no numbers");
  if (gripper_) {
    if (const std::string_view why = gripper_->why_not(); !why.empty()) return stop(why);
  }
  switch (phase_) {
    case Phase::kWaiting:
      return begin_program();
    case Phase::kDialling:
      return dial();
    case Phase::kUploading:
      return upload();
    case Phase::kStarting:
      return await_program();
    case Phase::kFollowing:
      return watch_program();
    case Phase::kStopped:
      return;
  }
}

void UniversalRobotsArm::begin_program() {
  const bool stands = state_.joints.dq.cwiseAbs().maxCoeff() < kStanding;
  double away = 0.0;
  for (int i = 0; i < 6; ++i) away = std::max(away, std::abs(report_.target_q[i] - report_.q[i]));
  const bool runs = program_is_ours();
  if (runs) send_input(nullptr);
  if (runs || !stands || !(away <= settings_.start_tolerance)) {
    if (!long_ago(settings_.start_within)) return;
    return stop("the arm is not stationary at its controller's set-point: remove what pushes it");
  }
  if (!(report_.slider >= kFullSpeed)) {
    return stop(words(next_words(), "the speed slider is at {:.0f} %: move it to 100 % at the pendant",
                      100.0 * report_.slider));
  }
  if (report_.playing() && !settings_.replace_program) {
    if (!long_ago(kEnding)) return;  // ours may be about to end
    return stop("another program runs on the controller: stop it at the pendant, or set ur.replace_program");
  }
  for (int i = 0; i < 6; ++i) {
    if (report_.q[i] < model_->position_min[i] || report_.q[i] > model_->position_max[i]) {
      return stop(
          words(next_words(),
                "joint '{}' is at {:.4g} rad, beyond its position limits {:.4g} to {:.4g}: move it back at the pendant",
                model_->joints[i].name, report_.q[i], model_->position_min[i], model_->position_max[i]));
    }
  }
  phase_ = Phase::kDialling;
  phase_since_ = state_.cycle;
  connections_.replace(std::move(primary_));
}

void UniversalRobotsArm::dial() {
  primary_ = connections_.take_script();
  if (!primary_) {
    if (connections_.script_failed() || long_ago(settings_.start_within)) {
      stop(
          "the controller's primary interface does not answer: enable it at the pendant (Settings, Security, "
          "Services)");
    }
    return;
  }
  // A session number that was not used before: so old set-points in the registers move nothing, and a program that an
  // older process left does not take ours.
  program_.renew(std::max(report_.owner, report_.addressed));
  uploaded_ = 0;
  asked_to_stop_ = false;
  phase_ = Phase::kUploading;
  upload();
}

void UniversalRobotsArm::upload() {
  const auto bytes = bytes_of(program_.text());
  std::size_t sent = 0;
  if (!primary_ || primary_->send(bytes.subspan(uploaded_), sent) == Socket::Outcome::kClosed) {
    return stop("the controller closed the connection that a program is sent over");
  }
  uploaded_ += sent;
  if (uploaded_ < bytes.size()) return;
  phase_ = Phase::kStarting;
  phase_since_ = state_.cycle;
  begun_at_ = 0;
}

/// It runs when its cycle is seen to advance.
void UniversalRobotsArm::await_program() {
  if (program_is_ours()) {
    if (begun_at_ == 0) begun_at_ = report_.cycle;
    if (report_.cycle > begun_at_) {
      phase_ = Phase::kFollowing;
      check_.restart();
      last_command_ = {};
      counted_from_ = state_.cycle;
      begun_at_ = report_.cycle;
      return;
    }
  }
  if (ours() && report_.program < UrProgramState::kNone) return stop(why_ended(report_.program));
  if (!long_ago(settings_.start_within)) return;
  stop("the controller does not start the program: is it switched to remote control at the pendant?");
}

void UniversalRobotsArm::watch_program() {
  if (ours() && report_.program < UrProgramState::kNone) return stop(why_ended(report_.program));
  if (ours() && (report_.runtime == UrRuntime::kPausing || report_.runtime == UrRuntime::kPaused)) {
    return stop("the program on the controller was paused: stop it at the pendant, then reset");
  }
  if (!program_is_ours()) return stop("the program on the controller was stopped or replaced");
  if (!(report_.scaling * report_.slider >= kFullSpeed)) {
    return stop(words(next_words(),
                      "the controller slows the arm down to {:.0f} %: the speed slider, or its safety limits",
                      100.0 * report_.scaling * report_.slider));
  }
  if (!counts_cycles()) stop("the program on the controller misses cycles: it is too slow, or its speed is reduced");
}

/// The program's cycles against the controller's clock, a second at a time.
bool UniversalRobotsArm::counts_cycles() {
  const double per_cycle = version_.rate_hz() / info_.rate_hz;  // the program's for each of ours
  const std::uint64_t passed = state_.cycle - counted_from_;
  const double lost = per_cycle * static_cast<double>(passed) - static_cast<double>(report_.cycle - begun_at_);
  if (lost > settings_.lost_cycles_max * version_.rate_hz()) return false;
  if (static_cast<double>(passed) < info_.rate_hz) return true;
  counted_from_ = state_.cycle;
  begun_at_ = report_.cycle;
  return true;
}

void UniversalRobotsArm::send(const JointCommand& command) {
  if (phase_ != Phase::kFollowing) return;
  if (const std::string_view why = check_.refusal(command, state_.joints.q); !why.empty()) return stop(why);
  last_command_ = command;
  if (gripper_ && command.gripper[0]) gripper_->move_to(*command.gripper[0]);
  send_input(&command);
}

/// A set-point, or none: stop.
void UniversalRobotsArm::send_input(const JointCommand* command) {
  RtdeWriter input = rtde_->input();
  for (int i = 0; i < 6; ++i) input.put(command ? command->q[i] : report_.target_q[i]);
  for (int i = 0; i < 6; ++i) input.put(command ? command->dq[i] : 0.0);
  const bool accelerates = command != nullptr && command->ddq.size() == 6 && command->ddq.allFinite();
  for (int i = 0; i < 6; ++i) input.put(accelerates ? command->ddq[i] : 0.0);
  input.put(report_.cycle);
  input.put(std::int32_t{command ? 1 : 0});
  input.put(std::int32_t{program_.session()});
  (void)rtde_->send(input);  // one that does not get away is bridged like one lost on the way
}

std::span<char> UniversalRobotsArm::next_words() { return words_[next_words_++ % words_.size()]; }

void UniversalRobotsArm::stop(std::string_view reason) {
  const bool was_following = phase_ == Phase::kFollowing;
  if (phase_ != Phase::kStopped) state_.reason = reason;
  phase_ = Phase::kStopped;
  state_.status = ArmStatus::kStopped;
  if (was_following && rtde_) send_input(nullptr);
}

void UniversalRobotsArm::restart() {
  phase_ = Phase::kWaiting;
  phase_since_ = state_.cycle;
  state_.reason = {};
}

}  // namespace steadyhand
