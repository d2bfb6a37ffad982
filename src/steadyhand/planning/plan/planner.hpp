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

/// Settings of the solver and of the check of plans.
struct PlannerSettings {
  std::string solver = kDefaultSolver;  ///< see solver_names()
  double tolerance = 1e-6;              ///< tolerance of the KKT conditions, above 0, to 0.1
  SolveBudget budget;                   ///< iterations and time for each solve
  PlanCheckSettings check;              ///< check of a plan before it is followed
  /// m, 0 to kMostClearance: smallest distance between bodies at the nodes. It prevents contact between the nodes,
  /// where the optimal control problem has no constraints. A quarter of the smallest gap at home if that is less.
  double clearance = 2e-3;
  /// Obstacles at the start. A problem without rows for obstacles gets kUsualObstacleRows.
  Obstacles obstacles;
};

/// Figures of a solve, as recorded.
struct SolveFigures {
  double objective = 0.0;                       ///< J
  std::array<double, kMaxObjectives> shares{};  ///< share of each of Ocp::objectives() in J
  int iterations = 0;                           ///< iterations of the solver
  double time_us = 0.0;                         ///< wall time
};

/// Model predictive control (receding horizon): takes the newest prediction, solves from the state that the arm will
/// have on the plan that it follows, and returns the next plan, which is checked and ends at rest. If solving or the
/// check fails, the last good plan stays in force; it ends at rest too. Planner thread. make() allocates all memory;
/// update() allocates nothing (a third-party solver may).
class Planner {
 public:
  /// The model must outlive the planner. Fails with the reason on unknown names of solver or terms, on numbers out of
  /// range, also of the model, on constraints with invalid rows, bounds or entries, and if constructing one throws.
  /// Adds the objective of joint speeds if it is missing, see set_weights().
  static Result<std::unique_ptr<Planner>> make(const RobotModel& model, const OcpSettings& ocp,
                                               const PlannerSettings& settings);

  ~Planner();

  /// Resets the state: the arm is stationary at q.
  void reset(const JointVector& q, Time now);
  /// The arm follows this plan instead of the last one of update(); the next one continues it.
  void continue_from(const Plan& followed) { plan_ = followed; }
  /// Takes the state of the arm, the plan and the liquid from another planner. If that has no liquid, it is at rest.
  void continue_from(const Planner& before);
  /// Sets the state of a tool's liquid at a time, from the arm's real motion; from then on it is predicted on the
  /// followed plan. Does nothing without a liquid.
  void set_liquid(const SloshState& state, Time at, int tool = 0) {
    if (!liquids_.empty()) liquids_[tool].known = {state, at};
  }
  /// Another solver, of ocp(), than the settings name. @pre it is not null
  void use(std::unique_ptr<Solver> solver) { solver_ = std::move(solver); }
  /// Weights for the next plans, in the order of ocp().objectives(). Those of the joints' speeds count as at least
  /// kLeastDamping and a millionth of the largest weight: without damping, an arm drifts where the other terms do not
  /// hold it.
  void set_weights(std::span<const JointVector> weights);
  static constexpr double kLeastDamping = 0.02;  ///< s/rad^2

  /// Joints that the next plans only stop: in the fewest whole intervals, evenly. One that is stationary does not move
  /// at all. The others are planned for as before. Default: none.
  void set_given(JointSet joints);

  /// Obstacles for the next plans. Fails, and changes nothing, on invalid obstacles, and on any obstacle if the
  /// problem has no rows for them (OcpSettings::obstacle_rows).
  Status set_obstacles(const Obstacles& obstacles);

  /// Another glass at a tool, or another fill. Fails, and changes nothing, on an invalid one, and if the problem has no
  /// liquid (OcpSettings::liquid).
  Status set_glass(const GlassSettings& glass, int tool = 0);
  /// Whether the next plans must not spill. Default: true if the problem has a liquid.
  void set_no_spill(bool on) {
    for (LiquidInstance& liquid : instance_.liquid) liquid.counts = on && ocp_.liquid();
  }
  /// m: the highest wave that the liquids' models foresee along plan() and after it; 0 without a liquid.
  double highest_wave() const { return highest_wave_; }

  /// Pose of the second tool in the first for an objective that ties them.
  void set_held(const Pose& X_tool_tool) { instance_.held = {X_tool_tool.p, X_tool_tool.q.toRotationMatrix()}; }
  /// us for the next solves; 0: as long as they take
  void set_time_budget(double us) { settings_.budget.time_us = us; }

  /// The plan from reference.start on. Times must not go backwards. With origin kPrevious it is the last plan
  /// unchanged.
  const Plan& update(const Reference& reference);

  const Plan& plan() const { return plan_; }  ///< the newest that may be followed
  const Ocp& ocp() const { return ocp_; }     ///< what is solved
  // ---- the last update: problem, guess and result
  const OcpInstance& instance() const { return instance_; }  ///< x_0, reference and weights
  const Trajectory& guess() const;                           ///< where the solver began
  const Solution& solution() const { return solution_; }     ///< also if the plan was refused
  /// Of solution(). Evaluates the objectives; allocates nothing.
  SolveFigures figures();
  PlanFault fault() const { return fault_; }  ///< fault of the last candidate; kNone: it is plan()

 private:
  Planner(const RobotModel& model, Ocp ocp, const PlannerSettings& settings);
  void set_clearance(Time now);
  void find_plan(const Reference& reference);
  void find_any_plan(const Reference& reference);
  void find_level_plan(const Reference& reference);
  /// Waves of the liquids that count.
  struct Waves {
    double highest = 0.0;  ///< m
    double over = 0.0;     ///< m, over the rim; negative below
  };
  template <typename F>
  Waves waves(const F& wave_of);
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
  /// Of one tool, in a problem with a liquid.
  struct Liquid {
    std::unique_ptr<LiquidEstimate> estimate;
    /// The state at a time; on the way along plan_ from there on.
    struct {
      SloshState state = SloshState::Zero();
      Time at{0};
    } known;
  };
  std::vector<Liquid> liquids_;  ///< of each tool, or none
  double highest_wave_ = 0.0;
  PlanFault fault_ = PlanFault::kNone;
};

}  // namespace steadyhand
