#include "steadyhand/arms/ur/robotiq_gripper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace steadyhand {

namespace {

constexpr int kClosed = 255;
constexpr int kActive = 3;       ///< value of STA
constexpr int kFirstFault = 10;  ///< value of FLT; values below are requests that came too early
constexpr Time kTurn = std::chrono::milliseconds(20);
constexpr Time kDialAgain = std::chrono::milliseconds(500);

int register_value(double share) { return static_cast<int>(std::lround(kClosed * std::clamp(share, 0.0, 1.0))); }

}  // namespace

Result<std::unique_ptr<RobotiqGripper>> RobotiqGripper::connect(Dial dial, const RobotiqSettings& settings) {
  std::unique_ptr<RobotiqGripper> gripper(new RobotiqGripper(std::move(dial), settings));
  if (const Status s = gripper->open(); !s) return s.error();
  gripper->keeper_ = std::thread([g = gripper.get()] { g->keep(); });
  return gripper;
}

RobotiqGripper::~RobotiqGripper() {
  running_ = false;
  if (keeper_.joinable()) keeper_.join();
}

void RobotiqGripper::move_to(double closed) {
  if (std::isfinite(closed)) wanted_.store(register_value(closed), std::memory_order_relaxed);
}

std::string_view RobotiqGripper::why_not() const {
  switch (health_.load(std::memory_order_relaxed)) {
    case Health::kFine:
      return {};
    case Health::kSilent:
      return "the gripper's server on the controller does not answer";
    case Health::kInactive:
      return "the gripper is not activated: activate it at the pendant";
    case Health::kFault:
      return "the gripper reports a fault: look at the pendant";
  }
  return {};
}

Status RobotiqGripper::set(const char* variable, int value) {
  const auto answer = lines_->ask(fmt::format("SET {} {}", variable, value));
  if (!answer) return answer.error();
  if (*answer != "ack") {
    return Error{fmt::format("the gripper's server answers '{}' to 'SET {} {}'; 'ack' would be right",
                             answer->substr(0, 60), variable, value)};
  }
  return Done{};
}

Result<int> RobotiqGripper::get(const char* variable) {
  const auto answer = lines_->ask(fmt::format("GET {}", variable));
  if (!answer) return answer.error();
  const std::string head = fmt::format("{} ", variable);
  int value = 0;
  const char* const end = answer->data() + answer->size();
  const char* const number = answer->data() + std::min(head.size(), answer->size());
  const auto [rest, error] = std::from_chars(number, end, value);
  if (!answer->starts_with(head) || error != std::errc() || rest != end || value < 0 || value > kClosed) {
    return Error{fmt::format("the gripper's server answers '{}' to 'GET {}'; '{} 0' to '{} {}' would be right",
                             answer->substr(0, 60), variable, variable, variable, kClosed)};
  }
  return value;
}

/// Connects, checks that the gripper is ready, and sets speed and force; sends no position yet.
Status RobotiqGripper::open() {
  auto socket = dial_();
  if (!socket) return socket.error();
  lines_ = std::make_unique<TextLines>(*std::move(socket), "the gripper's server", from_seconds(settings_.timeout));
  told_ = -1;
  if (const Status s = look(); !s) return s;
  if (const std::string_view why = why_not(); !why.empty()) return Error{std::string(why)};
  const std::pair<const char*, int> first[] = {
      {"SPE", register_value(settings_.speed)}, {"FOR", register_value(settings_.force)}, {"GTO", 1}};
  for (const auto& [variable, value] : first) {
    if (Status s = set(variable, value); !s) return s;
  }
  return Done{};
}

/// Where it is, and whether it is well.
Status RobotiqGripper::look() {
  const Result<int> status = get("STA");
  if (!status) return status.error();
  const Result<int> fault = get("FLT");
  if (!fault) return fault.error();
  const Result<int> position = get("POS");
  if (!position) return position.error();
  position_ = static_cast<double>(*position) / kClosed;
  health_ = *fault >= kFirstFault ? Health::kFault : *status != kActive ? Health::kInactive : Health::kFine;
  return Done{};
}

/// Reads the position, and sends the wanted one if it is new.
Status RobotiqGripper::turn() {
  Status s = lines_ ? look() : open();
  if (const int wanted = wanted_; s && health_ == Health::kFine && wanted != told_ && wanted >= 0) {
    s = set("POS", wanted);
    if (s) told_ = wanted;
  }
  return s;
}

void RobotiqGripper::keep() {
  while (running_) {
    bool answered = false;
    try {
      answered = static_cast<bool>(turn());
    } catch (const std::exception&) {  // no memory: it is tried again
    }
    if (!answered) {
      if (health_ == Health::kFine) health_ = Health::kSilent;
      lines_.reset();
    }
    const Time pause = lines_ ? kTurn : kDialAgain;
    for (Time slept{0}; slept < pause && running_; slept += kTurn) std::this_thread::sleep_for(kTurn);
  }
}

}  // namespace steadyhand
