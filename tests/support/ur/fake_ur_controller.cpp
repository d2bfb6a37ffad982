#include "support/ur/fake_ur_controller.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace steadyhand {

namespace {

constexpr double kHeldBack = 15.0;   ///< rad/s^2, at which a controller stops an arm that no program moves
constexpr double kSliderRamp = 2.0;  ///< 1/s

}  // namespace

FakeUrController::FakeUrController(const RobotModel& model, const Settings& settings)
    : settings_(settings),
      model_(model),
      target_(model.home),
      target_dq_(JointVector::Zero(6)),
      wanted_(model.home),
      move_begin_(model.home),
      paused_(settings.paused),
      remote_(settings.remote_control),
      kinematics_(model_) {
  model_.velocity_max *= 1.2;
  // servoj smooths over its lookahead: of a step between set-points the joints feel a fifteenth at 500 Hz.
  model_.acceleration_max *= 40.0;
  SimulatedArmSettings arm;
  arm.rate_hz = settings.version.rate_hz();
  arm.latency = 0.0;
  arm.servo_lag = settings.servo_lag;
  arm.start_time = 0.0;
  arm_ = std::make_unique<SimulatedArm>(model_, model.home, arm, arm_clock_);
  measured_ = arm_->receive();
  make_builtins();
}

FakeUrController::~FakeUrController() {
  stop();
  program_.reset();
}

// ---------------------------------------------------------------------------------------------- connections

Status FakeUrController::listen() {
  const std::uint16_t wanted[] = {settings_.rtde_port, settings_.script_port, settings_.dashboard_port};
  for (int i = 0; i < 3; ++i) {
    Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int on = 1;
    (void)setsockopt(socket.descriptor(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(wanted[i]);
    if (inet_pton(AF_INET, settings_.address.c_str(), &address.sin_addr) != 1) {
      return Error{fmt::format("'{}' is no IPv4 address", settings_.address)};
    }
    socklen_t size = sizeof(address);
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    if (::bind(socket.descriptor(), generic, size) != 0 || ::listen(socket.descriptor(), 8) != 0 ||
        ::getsockname(socket.descriptor(), generic, &size) != 0) {
      return Error{fmt::format("cannot listen on {}:{} ({})", settings_.address, wanted[i], std::strerror(errno))};
    }
    ports_[i] = ntohs(address.sin_port);
    listeners_[i] = std::move(socket);
  }
  return Done{};
}

void FakeUrController::accept_rtde(Socket socket) {
  rtde_peers_.push_back(std::make_unique<RtdePeer>());
  rtde_peers_.back()->socket = std::move(socket);
}

void FakeUrController::accept_script(Socket socket) {
  text_peers_.push_back(std::make_unique<TextPeer>());
  text_peers_.back()->socket = std::move(socket);
  text_peers_.back()->writable = remote_ || settings_.version.major < 5;
}

void FakeUrController::accept_all() {
  for (int i = 0; i < 3; ++i) {
    if (!listeners_[i]) continue;
    for (;;) {
      Socket socket(::accept4(listeners_[i].descriptor(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (!socket) break;
      if (i == 0) {
        accept_rtde(std::move(socket));
        continue;
      }
      accept_script(std::move(socket));
      if (i != 2) continue;
      text_peers_.back()->dashboard = true;
      if (settings_.polyscope_x()) continue;
      (void)text_peers_.back()->socket.send_all("Connected: Universal Robots Dashboard Server\n",
                                                std::chrono::seconds(1));
    }
  }
}

void FakeUrController::serve() {
  accept_all();
  for (auto& peer : rtde_peers_) serve_rtde(*peer);
  for (auto& peer : text_peers_) serve_text(*peer);
  std::erase_if(rtde_peers_, [](const auto& peer) { return peer->gone; });
  std::erase_if(text_peers_, [](const auto& peer) { return peer->gone; });
}

// ---------------------------------------------------------------------------------------------- the robot

bool FakeUrController::may_move() const {
  const UrSafety safety = safety_;
  return mode_ == UrRobotMode::kRunning && (safety == UrSafety::kNormal || safety == UrSafety::kReduced);
}

void FakeUrController::step() {
  ++cycle_;
  spoke_ = false;
  time_ = static_cast<double>(cycle_) * period();
  {
    const std::lock_guard lock(asked_mutex_);
    for (const std::string& what : std::exchange(asked_, {})) press(what);
  }
  if (drop_asked_.exchange(false)) {
    rtde_peers_.clear();
    text_peers_.clear();
  }
  if (unplugged_ > 0) --unplugged_;
  if (unplugged_ == 0) serve();
  count_unanswered();
  if (protective_asked_.exchange(false)) arm_->trip("protective stop");
  if (!may_move() && program_ != nullptr) paused_ = true;  // where it is, with all that it holds
  run_program();
  advance_robot();
  for (auto& peer : rtde_peers_) {
    if (peer->started && time_ + 0.5 * period() > peer->due) {
      peer->due = std::max(peer->due, time_ - period()) + 1.0 / peer->rate_hz;
      RtdeWriter writer(RtdeType::kData);
      if (peer->protocol >= 2) writer.put(peer->output.id);
      for (std::size_t k = 0; k < peer->output.names.size(); ++k) {
        put_output(writer, peer->output.names[k], peer->output.types[k]);
      }
      send(*peer, writer);
    }
    flush(*peer);
  }
  // The primary interface sends its clients the state ten times a second, whether they want it or not.
  if (cycle_ % 50 != 0 || unplugged_ > 0) return;
  for (auto& peer : text_peers_) {
    if (!peer->dashboard) tell_state(*peer);
  }
}

/// A cycle of the program, if it is its turn: a motion at half the speed takes two.
void FakeUrController::run_program() {
  if (paused_ || program_ == nullptr) {
    moves_ = false;
    return;
  }
  scaling_ += std::clamp(slider_ - scaling_, -kSliderRamp * period(), kSliderRamp * period());
  progress_ += scaling_;
  if (moves_ && progress_ <= 1.0 + 1e-9) return;
  progress_ = moves_ ? progress_ - 1.0 : scaling_;
  move_begin_ = moves_ ? wanted_ : target_;
  moves_ = false;
  const bool goes_on = program_->cycle();
  overruns_ = static_cast<std::uint64_t>(program_->overruns());
  largest_effort_ = program_->largest_effort();
  if (goes_on) return;
  const std::string error = program_->error();
  if (!error.empty()) tell_exception(error);
  end_program(error);
}

bool FakeUrController::press_play() {
  if (!may_move() || !paused_ || program_ == nullptr) return false;
  paused_ = false;
  return true;
}

bool FakeUrController::try_unlock() {
  if (safety_ != UrSafety::kProtectiveStop) return true;
  if (time_ - stopped_at_ < settings_.unlock_wait) return false;
  safety_ = UrSafety::kNormal;
  arm_->restart();
  return true;
}

void FakeUrController::unlock() {
  stopped_at_ = -1e9;
  (void)try_unlock();
}

bool FakeUrController::ask(const std::string& what) {
  static const std::vector<std::string> kKnown = {"pause",  "play",      "stop",  "foreign", "protective", "unlock",
                                                  "normal", "safeguard", "local", "remote",  "reduced",    "off",
                                                  "on",     "slider",    "lag",   "unplug"};
  if (std::find(kKnown.begin(), kKnown.end(), what.substr(0, what.find(' '))) == kKnown.end()) return false;
  const std::lock_guard lock(asked_mutex_);
  asked_.push_back(what);
  return true;
}

void FakeUrController::press(const std::string& what) {
  const std::size_t space = std::min(what.find(' '), what.size());
  const std::string word = what.substr(0, space);
  const double number = std::strtod(what.c_str() + space, nullptr);
  if (word == "pause") press_pause();
  if (word == "play") (void)press_play();
  if (word == "stop") press_stop();
  if (word == "foreign") play_foreign_program();
  if (word == "protective") protective_stop();
  if (word == "unlock") (void)try_unlock();
  if (word == "reduced") set_safety(UrSafety::kReduced);
  if (word == "normal") set_safety(UrSafety::kNormal);
  if (word == "safeguard") set_safety(UrSafety::kSafeguardStop);
  if (word == "local" || word == "remote") set_remote(word == "remote");
  if (word == "off" || word == "on") set_mode(word == "on" ? UrRobotMode::kRunning : UrRobotMode::kPowerOff);
  if (word == "slider") set_slider(number);
  if (word == "lag") lag(static_cast<int>(number));
  if (word == "unplug") unplug(static_cast<int>(number));
}

void FakeUrController::play_foreign_program() {
  end_program("replaced at the pendant");
  paused_ = false;
  program_ =
      std::make_unique<urscript::Program>("def palletizing():\n  while True:\n    sync()\n  end\nend\n", builtins_);
}

/// By the registers of our program, see docs/reference/ur.md.
void FakeUrController::count_unanswered() {
  constexpr int kAnswer = 24, kFollow = 25, kState = 24, kFollowing = 2;
  const bool follows = program_ != nullptr && int_out_[kState] == kFollowing && int_in_[kFollow] == 1;
  if (follows && int_in_[kAnswer] == last_answer_) ++unanswered_;
  last_answer_ = int_in_[kAnswer];
}

void FakeUrController::advance_robot() {
  const double dt = period();
  JointVector next = wanted_;
  if (moves_) {
    if (progress_ < 1.0) next = move_begin_ + progress_ * (wanted_ - move_begin_);
  } else {
    const JointVector change = target_dq_.cwiseAbs().cwiseMin(kHeldBack * dt);
    next = target_ + dt * (target_dq_ - target_dq_.cwiseSign().cwiseProduct(change));
  }
  const JointVector dq = (next - target_) / dt;
  if (safety_ != UrSafety::kProtectiveStop) {
    largest_acceleration_ = std::max(largest_acceleration_, (dq - target_dq_).cwiseAbs().maxCoeff() / dt);
    largest_speed_ = std::max(largest_speed_, dq.cwiseAbs().maxCoeff());
    const JointVector step = next - target_ - 0.5 * dt * (dq + target_dq_);
    largest_position_step_ = std::max(largest_position_step_, step.cwiseAbs().maxCoeff());
    target_ = next;
    target_dq_ = dq;
    const Time now = measured_.joints.stamp.made;
    arm_->send({{now, now}, target_, target_dq_, JointVector::Zero(6)});
  }
  measured_ = arm_->receive();
  if (measured_.status == ArmStatus::kStopped && may_move()) {
    last_error_ = measured_.reason;
    safety_ = UrSafety::kProtectiveStop;
    stopped_at_ = time_;
    paused_ = paused_ || program_ != nullptr;
  }
  watch_speeds();
  if (safety_ == UrSafety::kProtectiveStop) {  // a stopped arm's target is where it stands
    target_ = arm_->q();
    target_dq_.setZero();
  }
}

/// The safety system's limits of speed, of the tool and of the elbow.
void FakeUrController::watch_speeds() {
  kinematics_.set_position(target_);
  const Vector3 tool = kinematics_.p();
  Eigen::Isometry3d elbow = Eigen::Isometry3d::Identity();
  for (int k = 0; k < 3; ++k) elbow = elbow * model_.joints[k].origin * motion(model_.joints[k], target_[k]);
  const SpeedCaps& caps = safety_ == UrSafety::kReduced ? settings_.reduced : settings_.normal;
  const double tool_speed = (tool - tool_).norm() / period();
  const double elbow_speed = (elbow.translation() - elbow_).norm() / period();
  if (std::exchange(watched_, true) && may_move() && (tool_speed > caps.tool || elbow_speed > caps.elbow)) {
    last_error_ = fmt::format("safety violation: tool {:.2f} m/s, elbow {:.2f} m/s", tool_speed, elbow_speed);
    safety_ = UrSafety::kViolation;
  }
  tool_ = tool;
  elbow_ = elbow.translation();
}

void FakeUrController::run() {
  running_ = true;
  thread_ = std::thread([this] {
    MonotonicClock clock;
    const Time cycle = from_seconds(period());
    for (Time next = clock.now(); running_; next = std::max(next + cycle, clock.now() - 5 * cycle)) {
      clock.sleep_until(next);
      step();
    }
  });
}

void FakeUrController::stop() {
  running_ = false;
  if (thread_.joinable()) thread_.join();
}

}  // namespace steadyhand
