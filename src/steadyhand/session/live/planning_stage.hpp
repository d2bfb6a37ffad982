#pragma once

#include <memory>
#include <optional>

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

/// The planner thread's work, once a planning period: gate and retarget the samples of the hand, predict, and plan on
/// from the plan that the control loop follows. Allocates nothing after make().
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
  const Reach& reach() const { return reach_; }
  /// The planner's estimate of the liquid, at the newest command known to the last step. Zero if the problem has none.
  const SloshState& liquid() const { return liquid_state_; }

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
                std::optional<ScaledPlanner> after_first_moves, const Reach& reach);
  Time next_start(Time now) const;
  void follow_liquid();
  void apply_settings(Time now, const JointCommand& at_start);
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
  void take_hand(Time now, const Pose& X_base_tool);
  void change_holder(std::uint64_t holder);
  void follow_state(Time now, const JointCommand& at_start, const Pose& X_base_tool);
  void leave_first_moves();
  void send_target(const Target& target);
  void plan_following(Time start);
  void plan_rest(const JointCommand& at_start);
  void plan_standing(const JointCommand& at_start);
  bool solve(Time start, std::span<const JointVector> weights);
  void tap();
  void send(const Plan& plan);

  PlanningSettings settings_;
  Links* links_;
  const Clock* clock_;
  Reach reach_;
  HandGate gate_;
  HandDelay delay_;
  Retargeter retargeter_;
  Predictor predictor_;
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
  std::vector<std::optional<LiquidEstimate>> liquids_;  ///< by planner
  LiquidEstimate* liquid_ = nullptr;                    ///< the entry of the planner in use
  SloshState liquid_state_ = SloshState::Zero();        ///< at moved_
  JointCommand moved_;                                  ///< newest of Links::moved
  std::uint64_t refills_ = 0;                           ///< Links::refills handled so far
  bool is_fresh_ = false;                               ///< another fill was set since
  GlassSettings glass_;
  Plan followed_, sent_;  ///< the plan control follows, as far as known; the plan sent last
  std::uint64_t engagement_ = 0, grip_ = 0, holder_ = 0;  ///< engagement and grip followed last
  bool following_ = false;
  Time resting_since_{0};
  std::vector<JointVector> weights_, rest_weights_;
  Reference reference_;  ///< for the newest solve
  Plan stop_;
  PlanningRecord record_;
  Time next_tap_{0};
  OperatorSample trusted_;  ///< newest good sample
  PlannerView view_;
};

}  // namespace steadyhand
