#pragma once

#include <array>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

/// The liquid's state, predicted from the motion that was commanded: no sensor sees it. Scratch of one thread;
/// allocates nothing after the constructor.
class LiquidEstimate {
 public:
  /// The model must outlive it.
  LiquidEstimate(const RobotModel& model, const LiquidSettings& settings);

  /// Another glass, or another fill: from here on.
  void set_glass(const GlassSettings& glass);

  /// At rest in a glass that stands at q.
  SloshState at_rest(const JointVector& q);
  /// The state at time t on the plan, when at time `from` it was `state`. What would have swung over the rim has
  /// spilled, and left waves as high as the rim.
  SloshState at(const Plan& plan, const SloshState& state, Time from, Time t);
  /// The same at the second of two commands, when at the first it was `state`: by the motion that has the positions and
  /// speeds of both, also where the arm moved without commands in between. After more than a second: at rest.
  SloshState between(const JointCommand& first, const JointCommand& second, const SloshState& state);
  /// m: the highest wave of any of the problem's modes along the plan from time t on, when it is in `state`, and ever
  /// after it.
  double highest(const Plan& plan, const SloshState& state, Time t);
  /// Goes along the plan from its start and keeps what it finds.
  void walk(const Plan& plan, const SloshState& state);
  /// m: the highest wave over the first intervals of the plan that was walked.
  double walked(int intervals) const { return heights_[intervals]; }
  /// m: the highest behind them, in a plan that goes on otherwise from there, and ever after it.
  double highest_behind(const Plan& plan, int intervals);
  /// s: the longest of the modes' periods.
  double period() const;

 private:
  /// Over `duration` s of constant acceleration of the joints; q and dq go with it. Returns the highest wave.
  double advance(JointVector& q, JointVector& dq, const JointVector& u, double duration, SloshState& state);
  /// For `duration` s in a glass that stands still.
  void stand(double duration, SloshState& state) const;
  double wave(const SloshState& state) const;
  void spill(SloshState& state) const;
  double finish(const Plan& plan, int first, double into, SloshState state);

  Kinematics arm_;
  LiquidSettings settings_;
  SloshModel model_;
  double frequency_ = 0.0, damping_ = 0.0;
  std::array<SloshState, kMaxHorizon + 1> states_;  ///< at the nodes that were walked
  std::array<double, kMaxHorizon + 1> heights_{};   ///< m, the highest wave up to there
};

}  // namespace steadyhand
