#pragma once

#include <cmath>

#include "steadyhand/core/arm.hpp"

namespace steadyhand {

/// All joints of a six-axis arm together back and forth, 1.8 rad from end to end at up to 1.8 rad/s, from where the arm
/// begins to follow; for tests of faults during motion.
class Swing {
 public:
  /// @param home rad; the swing moves back towards it
  explicit Swing(const JointVector& home) : home_(home) {}

  /// The next swing begins where the arm is then.
  void forget() { began_ = false; }
  /// The command for this state of an arm that follows. @param delay s, ArmInfo::delay
  JointCommand next(const JointState& state, double delay) {
    const Time now = state.stamp.made;
    if (!began_) {
      began_ = true;
      begin_ = now;
      q0_ = state.q;
      a_ = (q0_ - home_).mean() > 0.5 ? -0.9 : 0.9;
    }
    const double t = to_seconds(now - begin_), behind = t - delay;
    if (behind > 0.0) error_ = (state.q - q0_).mean() - a_ * (1.0 - std::cos(kPulse * behind));
    const JointVector ones = JointVector::Ones(q0_.size());
    return {{now, now},
            q0_ + a_ * (1.0 - std::cos(kPulse * t)) * ones,
            a_ * kPulse * std::sin(kPulse * t) * ones,
            a_ * kPulse * kPulse * std::cos(kPulse * t) * ones};
  }
  /// rad, mean of the joints: the distance from the arm's position to the one expected with its delay.
  double error() const { return error_; }

 private:
  static constexpr double kPulse = 2.0;  // rad/s
  JointVector home_;
  bool began_ = false;
  Time begin_{0};
  JointVector q0_;
  double a_ = 0.0, error_ = 0.0;
};

}  // namespace steadyhand
