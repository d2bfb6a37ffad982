#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/planning/plan/liquid_estimate.hpp"
#include "steadyhand/planning/plan/planner.hpp"
#include "steadyhand/planning/predict/predictor.hpp"
#include "steadyhand/planning/retarget/retargeter.hpp"
#include "steadyhand/session/live/hand_delay.hpp"
#include "steadyhand/session/live/links.hpp"
#include "steadyhand/session/live/live_settings.hpp"
#include "steadyhand/session/supervise/hand_gate.hpp"

namespace steadyhand {

/// The planner thread's work, once a planning period: gate and retarget the samples of each tool's hand, predict, and
/// plan on from the plan that the control loop follows. A joint moves if every tool that it moves follows its hand, or,
/// where an objective with a weight ties the tools, if any tool does. Allocates nothing after make().
class PlanningStage {
 public:
  /// Model, links and clock must outlive it. Takes about 50 ms for each problem. Fails as Planner::make does.
  static Result<std::unique_ptr<PlanningStage>> make(const RobotModel& model, const PlanningSettings& settings,
                                                     Links& links, const Clock& clock);
  /// @returns whether the solver ran
  bool step(Time now);
  /// s, PlanningSettings::look_ahead from the next step on. @param is_budget it also limits the solver's time
  void set_look_ahead(double look_ahead, bool is_budget) {
    settings_.look_ahead = look_ahead;
    if (!is_budget) return;
    for_each_planner([&](Planner& planner) { planner.set_time_budget(1e6 * look_ahead); });
  }

  /// Newest control cycle known to the last step.
  Time control_time() const { return report_.now; }
  /// The first problem, with the full limits. Any thread.
  const Ocp& ocp() const { return *ocp_; }
  /// Of each tool.
  std::span<const Reach> reaches() const { return reaches_; }
  /// The planner's estimate of a tool's liquid, at the newest command known to the last step. Zero if the problem has
  /// none.
  const SloshState& liquid(int tool = 0) const { return hands_[tool].liquid_state; }

 private:
  /// Planners for a share of the limits.
  struct ScaledPlanner {
    std::unique_ptr<const RobotModel> model;         ///< its limits less margins
    bool is_slow = false;                            ///< with a share of the limits
    std::vector<std::unique_ptr<Planner>> planners;  ///< as OperatorSettings::planner counts them
    Planner* planner = nullptr;                      ///< the one in use
    Kinematics arm;
  };
  static Result<ScaledPlanner> make_scaled(const RobotModel& model, double speed_scaling,
                                           const PlanningSettings& settings);

  PlanningStage(const PlanningSettings& settings, Links& links, const Clock& clock, ScaledPlanner scaled,
                std::optional<ScaledPlanner> after_first_moves, std::vector<Reach> reaches);
  Time next_start(Time now) const;
  void follow_liquid();
  void apply_settings(Time now, const JointCommand& at_start);
  void change_hold(Time now, const JointCommand& at_start);
  void latch_pose_of_tools();
  void pour(double fill);
  void use_planner(int planner);
  void use_liquid();
  void apply_obstacles();
  template <typename Use>
  void for_each_planner(const Use& use) {
    for (const auto& planner : scaled_.planners) use(*planner);
    if (!after_first_moves_) return;
    for (const auto& planner : after_first_moves_->planners) use(*planner);
  }
  void set_weights(std::span<const JointVector> weights);
  void take_hands(Time now);
  void change_holder(std::uint64_t holder);
  void follow_state(int tool, Time now, const JointCommand& at_start);
  void begin_following(int tool, const JointCommand& at_start);
  void end_following(int tool, Time now, const JointCommand& at_start);
  void leave_first_moves();
  void send_target(int tool, const Target& target);
  bool any_follows() const { return std::ranges::any_of(hands_, &Hand::following); }
  Pose tool_at_start(int tool) const { return {scaled_.arm.p(tool), Quaternion(scaled_.arm.R(tool))}; }
  bool holds_one_thing() const { return tie_ && weights_[*tie_].maxCoeff() > 0.0; }
  void settle(const JointCommand& at_start);
  std::span<const JointVector> weights_of_hands();
  Reference predict(Time start) const;
  void plan_following(const JointCommand& at_start);
  void plan_rest(const JointCommand& at_start);
  void plan_standing(const JointCommand& at_start);
  bool solve(Time start, std::span<const JointVector> weights);
  void tap();
  void send(const Plan& plan);

  PlanningSettings settings_;
  Links* links_;
  const Clock* clock_;
  std::vector<Reach> reaches_;
  /// What moves a tool.
  struct Hand {
    HandGate gate;
    HandDelay delay;
    Retargeter retargeter;
    Predictor predictor;
    OperatorSample trusted;                  ///< newest good sample
    std::uint64_t engagement = 0, grip = 0;  ///< followed last
    bool following = false;
    Time resting_since{0};  ///< the end of the last following
    bool settled = true;    ///< not following: its joints stop independently of the other tool, or are stationary
    SloshState liquid_state = SloshState::Zero();  ///< at moved_
    std::uint64_t refills = 0;                     ///< Links::refills handled so far
  };
  std::vector<Hand> hands_;  ///< by tool
  ScaledPlanner scaled_;
  std::optional<ScaledPlanner> after_first_moves_;  ///< replaces scaled_ after the first moves; then unused
  const Ocp* ocp_;
  double followed_for_ = 0.0;  ///< s
  Time last_step_{0};
  ControlReport report_;
  OperatorSettings operator_settings_;  ///< the newest
  bool settings_wait_ = false;          ///< the newest are not in force yet
  bool waited_ = false;                 ///< the value of settings_wait_ in the step before
  int planner_ = 0;                     ///< OperatorSettings::planner in use
  // The estimate of the liquid, for all planners; its glass is the newest that the operator set:
  std::vector<std::vector<LiquidEstimate>> liquids_;  ///< by planner and tool; of a planner without a liquid none
  std::vector<LiquidEstimate>* liquid_ = nullptr;     ///< the entry of the planner in use
  JointCommand moved_;                                ///< newest of Links::moved
  bool is_fresh_ = false;                             ///< another fill was set since
  GlassSettings glass_;
  Plan followed_, sent_;      ///< the plan control follows, as far as known; the plan sent last
  std::uint64_t holder_ = 0;  ///< of the last sample
  std::vector<JointVector> weights_, rest_weights_, mixed_weights_;
  std::optional<std::size_t> tie_;  ///< index of the objective with ObjectiveInfo::ties_tools
  Pose X_tool_tool_;                ///< of the second tool in the first, if they hold one thing
  Reference reference_;             ///< for the newest solve
  Plan stop_;
  PlanningRecord record_;
  Time next_tap_{0};
  PlannerView view_;
};

}  // namespace steadyhand
