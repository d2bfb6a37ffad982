#include "arm/ur_arm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

constexpr double kStanding = 0.01;        ///< rad/s, measured, below which an arm counts as standing
constexpr int kFirstSession = 100000001;  ///< nine digits, so that the next one takes as much room
constexpr Time kRetry = std::chrono::milliseconds(500);

RtdeRecipes recipes() {
  RtdeRecipes r;
  r.outputs = {{"timestamp", "DOUBLE", {}},
               {"target_q", "VECTOR6D", {}},
               {"actual_q", "VECTOR6D", {}},
               {"actual_qd", "VECTOR6D", {}},
               {"robot_mode", "INT32", {}},
               {"safety_status", "INT32", "safety_mode"},
               {"robot_status_bits", "UINT32", {}},
               {"output_int_register_24", "INT32", {}},
               {"output_int_register_25", "INT32", {}},
               {"output_int_register_26", "INT32", {}}};
  static_assert(UrRegisters::kState == 24 && UrRegisters::kCycle == 25 && UrRegisters::kOwner == 26);
  static constexpr std::string_view kDoubles[] = {
      "input_double_register_24", "input_double_register_25", "input_double_register_26", "input_double_register_27",
      "input_double_register_28", "input_double_register_29", "input_double_register_30", "input_double_register_31",
      "input_double_register_32", "input_double_register_33", "input_double_register_34", "input_double_register_35",
      "input_double_register_36", "input_double_register_37", "input_double_register_38", "input_double_register_39",
      "input_double_register_40", "input_double_register_41"};
  static_assert(UrRegisters::kQ == 24 && UrRegisters::kDq == 30 && UrRegisters::kDdq == 36);
  for (const std::string_view name : kDoubles) r.inputs.push_back({name, "DOUBLE", {}});
  static_assert(UrRegisters::kAnswers == 24 && UrRegisters::kMode == 25 && UrRegisters::kSession == 26);
  for (const char* name : {"input_int_register_24", "input_int_register_25", "input_int_register_26"}) {
    r.inputs.push_back({name, "INT32", {}});
  }
  return r;
}

std::string_view why_ended(UrProgramState state) {
  switch (state) {
    case UrProgramState::kSilence:
      return "set-points stopped reaching the controller";
    case UrProgramState::kTooFast:
      return "a set-point stepped, as the controller saw it";
    case UrProgramState::kTooFar:
      return "set-points were too far from where the arm stood";
    default:
      return "the program on the controller ended";
  }
}

}  // namespace

Result<std::unique_ptr<UniversalRobotsArm::Connection>> UniversalRobotsArm::open(Socket rtde, Socket script,
                                                                                 double patience) {
  auto client = RtdeClient::start(std::move(rtde), recipes(), from_seconds(patience));
  if (!client) return client.error();
  return std::make_unique<Connection>(Connection{*std::move(client), std::move(script)});
}

Result<std::unique_ptr<UniversalRobotsArm::Connection>> UniversalRobotsArm::open(const UrSettings& s) {
  auto rtde = Socket::connect(s.host, s.rtde_port, from_seconds(s.patience));
  if (!rtde) return rtde.error();
  auto script = Socket::connect(s.host, s.script_port, from_seconds(s.patience));
  if (!script) return script.error();
  return open(*std::move(rtde), *std::move(script), s.patience);
}

Result<std::unique_ptr<UniversalRobotsArm>> UniversalRobotsArm::connect(const RobotModel& model, const UrSettings& s,
                                                                        Clock& clock) {
  if (model.dof() != 6) return Error{fmt::format("robot '{}' has {} joints; a UR has 6", model.name, model.dof())};
  auto connection = open(s);
  if (!connection) return connection.error();
  std::unique_ptr<UniversalRobotsArm> arm(new UniversalRobotsArm(model, s, clock, *std::move(connection)));
  arm->keeper_ = std::thread([a = arm.get()] { a->reconnect(); });
  return arm;
}

Result<std::unique_ptr<UniversalRobotsArm>> UniversalRobotsArm::over(Socket rtde, Socket script,
                                                                     const RobotModel& model, const UrSettings& s,
                                                                     Clock& clock) {
  if (model.dof() != 6) return Error{fmt::format("robot '{}' has {} joints; a UR has 6", model.name, model.dof())};
  auto connection = open(std::move(rtde), std::move(script), s.patience);
  if (!connection) return connection.error();
  return std::unique_ptr<UniversalRobotsArm>(new UniversalRobotsArm(model, s, clock, *std::move(connection)));
}

UniversalRobotsArm::UniversalRobotsArm(const RobotModel& model, const UrSettings& settings, Clock& clock,
                                       std::unique_ptr<Connection> first)
    : model_(&model),
      settings_(settings),
      clock_(&clock),
      version_(first->rtde->controller()),
      protocol_(first->rtde->protocol()),
      program_(settings.program),
      connection_(std::move(first)),
      check_(model) {
  info_ = {fmt::format("{} (Universal Robots, software {}.{}.{})", model.name, version_.major, version_.minor,
                       version_.bugfix),
           6, connection_->rtde->rate_hz(), settings.delay};
  period_ = from_seconds(1.0 / info_.rate_hz);
  carry_on_ = {settings.program.bridged / info_.rate_hz, JointVector::Constant(6, settings.program.braking)};
  program_.session = kFirstSession;
  program_.velocity_max = model.velocity_max;
  program_.acceleration_max = model.acceleration_max;
  program_.state_period = 1.0 / info_.rate_hz;
  program_text_ = make_ur_program(program_);
  const std::string digits = std::to_string(kFirstSession);
  session_at_[0] = program_text_.find(digits);
  session_at_[1] = program_text_.find(digits, session_at_[0] + 1);
  state_.joints = {{clock.now(), clock.now()}, model.home, JointVector::Zero(6)};
  // So that where the joints are is known before the first cycle.
  for (int i = 0; i < 50 && !known_ && connection_->rtde->wait(period_); ++i) (void)listen();
}

UniversalRobotsArm::~UniversalRobotsArm() {
  if (connection_) stop("the program ends");
  running_ = false;
  ++lost_;
  lost_.notify_one();
  if (keeper_.joinable()) keeper_.join();
  delete incoming_.exchange(nullptr);
  delete outgoing_.exchange(nullptr);
}

// ---------------------------------------------------------------------------------------------- connections

/// The other thread: makes a new connection after each loss.
void UniversalRobotsArm::reconnect() {
  for (int seen = 0; running_;) {
    lost_.wait(seen);
    delete outgoing_.exchange(nullptr);
    if (!running_) return;
    seen = lost_;
    auto fresh = open(settings_);
    if (fresh) {
      delete incoming_.exchange(fresh->release());
      continue;
    }
    for (Time slept{0}; slept < kRetry && running_; slept += kRetry / 10) std::this_thread::sleep_for(kRetry / 10);
    --seen;  // again
  }
}

void UniversalRobotsArm::take_connection() {
  if (connection_ || incoming_.load(std::memory_order_relaxed) == nullptr) return;
  connection_.reset(incoming_.exchange(nullptr));
  known_ = silent_ = false;
}

void UniversalRobotsArm::lose_connection() {
  stop("the connection to the controller was lost");
  delete outgoing_.exchange(connection_.release());
  known_ = false;
  ++lost_;
  lost_.notify_one();
}

/// Takes in all that has come. @return whether there was a report
bool UniversalRobotsArm::listen() {
  bool heard = false;
  for (;;) {
    const Socket::Outcome outcome = connection_->rtde->fill();
    for (RtdeReader data({}); connection_->rtde->next(data); heard = true) read(data);
    if (outcome == Socket::Outcome::kDone) continue;
    if (outcome == Socket::Outcome::kClosed) lose_connection();
    return heard;
  }
}

void UniversalRobotsArm::read(RtdeReader& data) {
  report_.timestamp = data.take<double>();
  for (auto* joints : {&report_.target_q, &report_.q, &report_.dq}) {
    for (double& value : *joints) value = data.take<double>();
  }
  report_.mode = static_cast<UrRobotMode>(data.take<std::int32_t>());
  report_.safety = static_cast<UrSafety>(data.take<std::int32_t>());
  report_.status_bits = data.take<std::uint32_t>();
  report_.program = static_cast<UrProgramState>(data.take<std::int32_t>());
  report_.cycle = data.take<std::int32_t>();
  report_.owner = data.take<std::int32_t>();
  for (int i = 0; i < 6; ++i) {
    state_.joints.q[i] = report_.q[i];
    state_.joints.dq[i] = report_.dq[i];
  }
}

/// The script port also tells the controller's state ten times a second; nobody here wants it.
void UniversalRobotsArm::drain_script() {
  std::array<std::uint8_t, 4096> nobody;
  std::size_t received = 0;
  if (connection_ && connection_->script.receive(nobody, received) == Socket::Outcome::kClosed) lose_connection();
}

// ---------------------------------------------------------------------------------------------- the control thread

ArmState UniversalRobotsArm::receive() {
  take_connection();
  bool heard = false;
  if (connection_) {
    heard = listen();
    if (connection_ && !heard && connection_->rtde->wait(silent_ ? period_ : from_seconds(settings_.silence))) {
      heard = listen();
    }
  }
  if (heard) {
    silent_ = false;
    keep_time();
  } else {
    if (connection_ && !silent_) {
      silent_ = true;
      stop("no word from the controller");
    }
    keep_time_alone();
  }
  if (connection_) drain_script();
  if (connection_ && heard) proceed();
  state_.status = phase_ == Phase::kFollowing ? ArmStatus::kFollowing
                  : phase_ == Phase::kStopped ? ArmStatus::kStopped
                                              : ArmStatus::kStarting;
  if (phase_ != Phase::kStopped) state_.reason = {};
  tell_what_was_carried_on();
  return state_;
}

/// Cycles that we slept through the program bridged by itself, and braked. It would find its way to any set-point near
/// by; from where it is now there is none to find.
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

/// The phase has lasted for longer than that.
bool UniversalRobotsArm::long_ago(double seconds) const {
  return static_cast<double>(state_.cycle - phase_since_) > seconds * info_.rate_hz;
}

/// What the report means for us.
void UniversalRobotsArm::proceed() {
  if (phase_ == Phase::kStopped) {
    if (ours() && report_.program >= UrProgramState::kReady) send_input(nullptr);
    return;
  }
  if (const std::string_view why = why_not(report_.safety); !why.empty()) return stop(why);
  if (const std::string_view why = why_not(report_.mode); !why.empty()) return stop(why);
  if (!state_.joints.q.allFinite() || !state_.joints.dq.allFinite()) return stop("the robot reports no numbers");
  switch (phase_) {
    case Phase::kWaiting:
      return begin_program();
    case Phase::kUploading:
      return upload();
    case Phase::kStarting:
      if (ours() && report_.program >= UrProgramState::kReady) {
        phase_ = Phase::kFollowing;
        check_.restart();
        last_command_ = {};
      } else if (long_ago(settings_.start_within)) {
        stop("the controller does not start the program: switch it to remote control at the pendant");
      }
      return;
    case Phase::kFollowing:
      if (ours() && report_.program < UrProgramState::kNone) return stop(why_ended(report_.program));
      if (!ours() || (report_.status_bits & kUrProgramRunning) == 0) {
        return stop("the program on the controller was stopped or replaced");
      }
      return;
    case Phase::kStopped:
      return;
  }
}

void UniversalRobotsArm::begin_program() {
  const bool stands = state_.joints.dq.cwiseAbs().maxCoeff() < kStanding;
  double away = 0.0;
  for (int i = 0; i < 6; ++i) away = std::max(away, std::abs(report_.target_q[i] - report_.q[i]));
  const bool runs =
      ours() && report_.program >= UrProgramState::kReady && (report_.status_bits & kUrProgramRunning) != 0;
  if (runs) send_input(nullptr);
  if (runs || !stands || !(away <= settings_.start_tolerance)) {
    if (!long_ago(settings_.start_within)) return;
    return stop("the arm is not at rest where its controller wants it: nothing may push it");
  }
  for (int i = 0; i < 6; ++i) {
    if (report_.q[i] < model_->position_min[i] || report_.q[i] > model_->position_max[i]) {
      return stop("a joint stands beyond its position limit: move it back at the pendant");
    }
  }
  // Another number for each start, so that registers still full of the last one's set-points move nothing.
  ++program_.session;
  for (const std::size_t at : session_at_) {
    int rest = program_.session;
    for (int digit = 8; digit >= 0; --digit, rest /= 10) program_text_[at + digit] = static_cast<char>('0' + rest % 10);
  }
  uploaded_ = 0;
  phase_ = Phase::kUploading;
  upload();
}

void UniversalRobotsArm::upload() {
  const auto bytes = std::span(reinterpret_cast<const std::uint8_t*>(program_text_.data()), program_text_.size());
  std::size_t sent = 0;
  if (connection_->script.send(bytes.subspan(uploaded_), sent) == Socket::Outcome::kClosed) return lose_connection();
  uploaded_ += sent;
  if (uploaded_ < bytes.size()) return;
  phase_ = Phase::kStarting;
  phase_since_ = state_.cycle;
}

void UniversalRobotsArm::send(const JointCommand& command) {
  if (phase_ != Phase::kFollowing) return;
  if (const std::string_view why = check_.refusal(command, state_.joints.q); !why.empty()) return stop(why);
  last_command_ = command;
  send_input(&command);
}

/// A set-point, or none: stop.
void UniversalRobotsArm::send_input(const JointCommand* command) {
  RtdeWriter input = connection_->rtde->input();
  for (int i = 0; i < 6; ++i) input.put(command ? command->q[i] : report_.target_q[i]);
  for (int i = 0; i < 6; ++i) input.put(command ? command->dq[i] : 0.0);
  const bool accelerates = command != nullptr && command->ddq.size() == 6 && command->ddq.allFinite();
  for (int i = 0; i < 6; ++i) input.put(accelerates ? command->ddq[i] : 0.0);
  input.put(report_.cycle);
  input.put(std::int32_t{command ? 1 : 0});
  input.put(std::int32_t{program_.session});
  (void)connection_->rtde->send(input);  // one that does not get away is bridged like one lost on the way
}

void UniversalRobotsArm::stop(std::string_view reason) {
  const bool was_following = phase_ == Phase::kFollowing;
  if (phase_ != Phase::kStopped) state_.reason = reason;
  phase_ = Phase::kStopped;
  state_.status = ArmStatus::kStopped;
  if (was_following && connection_) send_input(nullptr);
}

void UniversalRobotsArm::restart() {
  phase_ = Phase::kWaiting;
  phase_since_ = state_.cycle;
  state_.reason = {};
}

}  // namespace steadyhand
