#pragma once

#include <algorithm>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/ocp/ocp.hpp"

namespace steadyhand {

/// The liquid's state, predicted from the motion that was commanded: no sensor sees it. Scratch of one thread; allocates
/// nothing after the constructor.
class LiquidEstimate {
 public:
  /// The model must outlive it.
  LiquidEstimate(const RobotModel& model, const LiquidSettings& settings);

  /// Another glass, or another fill: from here on.
  void set_glass(const GlassSettings& glass);

  /// At rest in a glass that stands at q.
  SloshState at_rest(const JointVector& q);
  /// The state at time t, when at the plan's start it was `state`.
  SloshState at(const Plan& plan, const SloshState& state, Time t);
  /// m: of any of the problem's modes.
  struct Heights {
    double first = 0.0;  ///< over the first intervals
    double rest = 0.0;   ///< over the others, and ever after the plan

    double after_all() const { return std::max(first, rest); }
  };
  /// The highest waves along the plan from time t on, when the liquid is in `state`.
  Heights highest(const Plan& plan, const SloshState& state, Time t, int first = 0);
  /// s: the longest of the modes' periods.
  double period() const;

 private:
  /// Over `duration` s of constant acceleration of the joints; q and dq go with it. Returns the highest wave.
  double advance(JointVector& q, JointVector& dq, const JointVector& u, double duration, SloshState& state);
  /// For `duration` s in a glass that stands still.
  void stand(double duration, SloshState& state) const;
  double wave(const SloshState& state) const;

  Kinematics arm_;
  LiquidSettings settings_;
  SloshModel model_;
  double frequency_ = 0.0, damping_ = 0.0;
};

}  // namespace steadyhand
