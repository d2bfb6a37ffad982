#pragma once

#include <optional>
#include <string>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// A program that commands where the tools are to be.
struct PolicyInfo {
  std::string name;
  double period = 0.05;  ///< s, from one of its targets to the next
};

/// A policy's target; NaN is passed on, and the hand's gate refuses it.
struct PolicyTarget {
  Pose X_base_tool;
  std::optional<double> gripper;  ///< 0 open to 1 closed; absent: as it is
  int tool = 0;                   ///< index of the tool
};

/// Turns a policy's targets for one tool, which come at the policy's pace, into samples of a live hand, 100 a second
/// from the first target on. A target is where the tool is to be when the next one is due: samples go there along a
/// line within a period, and stay. If none comes for kPatience, or three periods, samples report that there is no pose.
/// One thread at a time; allocates nothing after it was made.
class PolicyHand {
 public:
  static constexpr double kFastest = 0.004, kSlowest = 0.5;  ///< s, of PolicyInfo::period
  static constexpr Time kPatience = std::chrono::milliseconds(250);

  /// @pre the period is from kFastest to kSlowest
  explicit PolicyHand(const PolicyInfo& info) : period_(info.period) {}

  /// Its turn begins: the hand opens, and closes once there is a target that is not stale.
  void begin(Time now);
  void take(const PolicyTarget& target, Time now);
  /// The next sample if its time has come by `now`: call until false.
  bool next(Time now, OperatorSample& sample);
  Time due() const { return heard_ == Time::min() ? Time::max() : due_; }  ///< when the next sample is due

 private:
  Pose at(Time t) const;
  bool is_stale(Time t) const;

  static constexpr Time kPeriod = std::chrono::milliseconds(10);

  double period_;  ///< s
  PolicyTarget target_;
  Pose from_;                 ///< where samples were when the newest target came
  Time heard_ = Time::min();  ///< when the newest target came; this before the first
  Time due_{0};
  bool open_ = true;
};

}  // namespace steadyhand
