#pragma once

#include <array>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

/// The state of one tool's liquid, predicted from the commanded motion: no sensor measures it. Scratch of one thread;
/// allocates nothing after the constructor.
class LiquidEstimate {
 public:
  /// The model must outlive it.
  LiquidEstimate(const RobotModel& model, const LiquidSettings& settings, int tool = 0);

  /// Sets another glass or another fill.
  void set_glass(const GlassSettings& glass);

  /// Liquid at rest in a stationary glass, with the arm at q.
  SloshState at_rest(const JointVector& q);
  /// The state at time t on the plan, if it was `state` at time `from`. A wave above the rim has spilled and is as high
  /// as the rim afterwards.
  SloshState at(const Plan& plan, const SloshState& state, Time from, Time t);
  /// The same at the second of two commands, when at the first it was `state`: by the motion that has the positions and
  /// speeds of both, also where the arm moved without commands in between. After more than a second: at rest.
  SloshState between(const JointCommand& first, const JointCommand& second, const SloshState& state);
  /// m: the highest wave of any of the problem's modes from time t on, along the plan and after it, if the liquid is in
  /// `state` at t.
  double highest(const Plan& plan, const SloshState& state, Time t);
  /// Simulates the liquid along the plan from its start and keeps states and heights.
  void walk(const Plan& plan, const SloshState& state);
  /// m: the highest wave over the first intervals of the plan of walk().
  double walked(int intervals) const { return heights_[intervals]; }
  /// m: the highest wave after these intervals, in a plan that continues differently from there, and after its end.
  double highest_behind(const Plan& plan, int intervals);
  /// s: the longest of the modes' periods.
  double period() const;

 private:
  /// Advances state, q and dq by `duration` s at constant joint acceleration. Returns the highest wave.
  double advance(JointVector& q, JointVector& dq, const JointVector& u, double duration, SloshState& state);
  /// Advances the state by `duration` s in a stationary glass.
  void stand(double duration, SloshState& state) const;
  double wave(const SloshState& state) const;
  void spill(SloshState& state) const;
  double finish(const Plan& plan, int first, double into, SloshState state);

  Kinematics arm_;
  int tool_;
  LiquidSettings settings_;
  SloshModel model_;
  double frequency_ = 0.0, damping_ = 0.0;
  std::array<SloshState, kMaxHorizon + 1> states_;  ///< at the nodes of walk()
  std::array<double, kMaxHorizon + 1> heights_{};   ///< m, the highest wave up to there
};

}  // namespace steadyhand
