#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>

#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/plan/plan_check.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

class LiquidEstimate;
class ObstacleRows;
class WarmStart;

/// How plans are made, and what for they are looked at.
struct PlannerSettings {
  std::string solver = kDefaultSolver;  ///< see solver_names()
  double tolerance = 1e-6;              ///< tolerance of the KKT conditions, above 0, to 0.1
  SolveBudget budget;                   ///< iterations and time for each solve
  PlanCheckSettings check;              ///< before a plan is given out
  /// m, 0 to kMostClearance: how far apart bodies stay at the nodes, so that they do not meet between them, where the
  /// optimal control problem does not look. A quarter of the smallest gap at home where that is less.
  double clearance = 2e-3;
  /// What plans keep clear of at first. A problem that knows none gets kUsualObstacleRows for them.
  Obstacles obstacles;
};

/// Figures of a solve, as recorded.
struct SolveFigures {
  double objective = 0.0;                       ///< J
  std::array<double, kMaxObjectives> shares{};  ///< what each of Ocp::objectives() adds to J
  int iterations = 0;                           ///< iterations of the solver
  double time_us = 0.0;                         ///< wall time
};

/// Model predictive control (receding horizon): takes the newest prediction, solves from where the arm will be by the
/// plan that it follows, and gives out the next plan, checked and ending at rest. If solving or the check fails the
/// last good plan stays in force; it ends at rest too. Planner thread. Memory is taken by make(); update() allocates
/// nothing (what a third-party solver does inside is its own).
class Planner {
 public:
  /// The model must outlive the planner. Fails with the reason on unknown names of solver or terms, on numbers out of
  /// range, also of the model, on constraints whose rows, bounds or entries cannot be, and where making one throws.
  /// Objectives without that of the joints' speeds get it, see set_weights().
  static Result<std::unique_ptr<Planner>> make(const RobotModel& model, const OcpSettings& ocp,
                                               const PlannerSettings& settings);

  ~Planner();

  /// Resets the state: the arm is stationary at q.
  void reset(const JointVector& q, Time now);
  /// The arm follows this plan rather than the one that update() gave out last; the next one continues it.
  void continue_from(const Plan& followed) { plan_ = followed; }
  /// The arm, its plan and the liquid are where another planner knows them. Where that knows no liquid, it is at rest.
  void continue_from(const Planner& before);
  /// The liquid's state at a time, as the arm really moved; from there on it goes along the plan that is followed.
  void set_liquid(const SloshState& state, Time at) {
    liquid_state_ = state;
    liquid_at_ = at;
  }
  /// Another solver, of ocp(), than the settings name. @pre it is not null
  void use(std::unique_ptr<Solver> solver) { solver_ = std::move(solver); }
  /// Weights for the next plans, in the order of ocp().objectives(). Those of the joints' speeds count as at least
  /// kLeastDamping and a millionth of the largest weight: without damping, an arm drifts where the other terms do not
  /// hold it.
  void set_weights(std::span<const JointVector> weights);
  static constexpr double kLeastDamping = 0.02;  ///< s/rad^2

  /// What the next plans keep clear of. Fails, and changes nothing, on obstacles that cannot be, and on any where the
  /// problem has no rows for them (OcpSettings::obstacle_rows).
  Status set_obstacles(const Obstacles& obstacles);

  /// Another glass, or another fill. Fails, and changes nothing, on one that cannot be, and where the problem knows no
  /// liquid (OcpSettings::liquid).
  Status set_glass(const GlassSettings& glass);
  /// Whether the next plans shall not spill; at first they shall if the problem knows a liquid.
  void set_no_spill(bool on) { instance_.liquid.counts = on && ocp_.liquid(); }
  /// m: the highest wave that the liquid's model foresees along plan() and after it; 0 without a liquid.
  double highest_wave() const { return highest_wave_; }

  /// us for the next solves; 0: as long as they take
  void set_time_budget(double us) { settings_.budget.time_us = us; }

  /// The plan from reference.start on. Times must not go backwards. With origin kPrevious it is the last plan
  /// unchanged.
  const Plan& update(const Reference& reference);

  const Plan& plan() const { return plan_; }  ///< the newest that may be followed
  const Ocp& ocp() const { return ocp_; }     ///< what is solved
  // ---- about the last update: what was solved, from where, and what came of it
  const OcpInstance& instance() const { return instance_; }  ///< x_0, reference and weights
  const Trajectory& guess() const;                           ///< where the solver began
  const Solution& solution() const { return solution_; }     ///< also of a plan that was refused
  /// Of solution(). Evaluates the objectives; allocates nothing.
  SolveFigures figures();
  PlanFault fault() const { return fault_; }  ///< fault of the last candidate; kNone: it is plan()

 private:
  Planner(const RobotModel& model, Ocp ocp, const PlannerSettings& settings);
  void set_clearance(Time now);
  void find_plan(const Reference& reference);
  void find_any_plan(const Reference& reference);
  void find_level_plan(const Reference& reference);
  PlanFault check_candidate();
  void make_plan(const Reference& reference, int intervals);
  enum class Braking { kEven, kHard };
  void make_stop(int intervals, Braking braking);

  PlannerSettings settings_;
  Ocp ocp_;
  std::unique_ptr<Solver> solver_;
  JointVector velocity_max_;  ///< largest speeds of its plans
  std::size_t damping_ = 0;   ///< index into ocp_.objectives(): that of the joints' speeds
  Kinematics kinematics_;
  OcpInstance instance_;
  std::unique_ptr<WarmStart> warm_start_;  ///< from what plan_ was made of
  std::unique_ptr<ObstacleRows> obstacle_rows_;
  Solution solution_;
  Evaluation evaluation_;        ///< of figures()
  double more_clearance_ = 0.0;  ///< m, since plans were refused for contact
  Plan plan_, candidate_;
  // Of a problem with a liquid:
  std::unique_ptr<LiquidEstimate> liquid_;
  SloshState liquid_state_ = SloshState::Zero();  ///< at liquid_at_; on the way along plan_ from there on
  Time liquid_at_{0};
  double highest_wave_ = 0.0, freeboard_ = 0.0;
  PlanFault fault_ = PlanFault::kNone;
};

}  // namespace steadyhand
