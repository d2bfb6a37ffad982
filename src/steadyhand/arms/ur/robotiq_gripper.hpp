#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string_view>
#include <thread>

#include "steadyhand/arms/driver/ur_settings.hpp"
#include "steadyhand/arms/ur/text_lines.hpp"

namespace steadyhand {

/// A Robotiq gripper (2F-85, 2F-140, Hand-E) on a UR's wrist, through the server that its URCap runs on the controller:
/// lines of text over TCP, on port 63352. Positions there are 0 (open) to 255 (closed). A separate thread reads the
/// fingers' position, sends the wanted one, and connects again after a loss; the control thread never waits for it.
/// This class never activates the gripper: that moves the fingers over their whole range. Without power or messages
/// from us the gripper keeps its grip.
class RobotiqGripper {
 public:
  /// Makes a connection to the server; may block.
  using Dial = std::function<Result<Socket>()>;

  /// Connects, and reads the fingers' position. Fails if no such server answers, and, with what to do, if the gripper
  /// is not activated or reports a fault.
  static Result<std::unique_ptr<RobotiqGripper>> connect(Dial dial, const RobotiqSettings& settings);
  ~RobotiqGripper();

  /// Sets the fingers' wanted position, 0 open to 1 closed; clamps values beyond, ignores NaN.
  void move_to(double closed);
  /// Their newest reported position.
  double position() const { return position_.load(std::memory_order_relaxed); }
  /// Why the arm should stop; static text, empty: nothing is wrong.
  std::string_view why_not() const;

 private:
  enum class Health { kFine, kSilent, kInactive, kFault };

  RobotiqGripper(Dial dial, const RobotiqSettings& settings) : dial_(std::move(dial)), settings_(settings) {}
  Status open();
  Status set(const char* variable, int value);
  Result<int> get(const char* variable);
  Status look();
  Status turn();
  void keep();

  Dial dial_;
  RobotiqSettings settings_;
  std::unique_ptr<TextLines> lines_;  ///< null: no connection
  int told_ = -1;                     ///< the position that was sent last, 0 to 255; -1: none
  std::atomic<double> position_{0.0};
  std::atomic<int> wanted_{-1};  ///< as told_
  std::atomic<Health> health_{Health::kFine};
  std::atomic<bool> running_{true};
  std::thread keeper_;
};

}  // namespace steadyhand
