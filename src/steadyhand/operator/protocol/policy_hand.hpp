#pragma once

#include <optional>
#include <string>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// A program that says where the tool is to be.
struct PolicyInfo {
  std::string name;
  double period = 0.05;  ///< s, from one of its targets to the next
};

/// What a policy wants; numbers that are none are handed on, and the hand's gate refuses them.
struct PolicyTarget {
  Pose X_base_tool;
  std::optional<double> gripper;  ///< 0 open to 1 closed; absent: as it is
};

/// A policy's targets, which come at its own pace, as the samples of a live hand, 100 a second. A target is where the
/// tool is to be when the next one is due: samples go there along a line within a period, and stay. Where none comes
/// for kPatience, or three periods, samples say that there is no pose now. One thread at a time; allocates nothing
/// after it was made.
class PolicyHand {
 public:
  static constexpr double kFastest = 0.004, kSlowest = 0.5;  ///< s, of PolicyInfo::period
  static constexpr Time kPatience = std::chrono::milliseconds(250);

  /// @pre the period is from kFastest to kSlowest
  explicit PolicyHand(PolicyInfo info) : info_(std::move(info)) {}

  /// Its turn begins: the hand opens and grips once there is a target that is not stale.
  void begin(Time now);
  void take(const PolicyTarget& target, Time now);
  /// The next sample if its time has come by `now`: call until false.
  bool next(Time now, OperatorSample& sample);
  Time due() const { return due_; }  ///< of the next sample

 private:
  Pose at(Time t) const;
  bool is_stale(Time t) const;

  static constexpr Time kPeriod = std::chrono::milliseconds(10);

  PolicyInfo info_;
  PolicyTarget target_;
  Pose from_;                 ///< where samples were when the newest target came
  Time heard_ = Time::min();  ///< when the newest target came; this before the first
  Time due_{0};
  bool open_ = true;
};

}  // namespace steadyhand
