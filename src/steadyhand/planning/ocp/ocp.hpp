#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/planning/ocp/term.hpp"

namespace steadyhand {

struct OcpSettings;

/// Terms are const and may be shared by problems, also of several threads.
using Objectives = std::vector<std::shared_ptr<const Objective>>;
/// Makes a constraint for a robot, which must outlive it; null where the robot needs none.
using ConstraintMaker = std::function<std::shared_ptr<const Constraint>(const RobotModel&, const OcpSettings&)>;

/// Objectives of docs/explanation/formulation.md. A new one is one line in ocp.cpp.
Objectives default_objectives();
/// Further objectives, which a problem has only if its weights name them.
Objectives optional_objectives();
/// Constraints of the formulation; a new one is one line, too.
std::vector<ConstraintMaker> default_constraints();

/// By name of an objective; one number applies to all of its entries, one set of numbers to each tool.
using Weights = std::map<std::string, std::vector<double>>;

/// The liquid in the problem, in a glass at each tool; it must not spill.
struct LiquidSettings {
  GlassSettings glass;  ///< its glass
  /// m, margin of the first mode's wave below the rim, because crests are higher than that wave. In a nearly full
  /// glass: three quarters of the freeboard, if that is less.
  double margin = 5e-3;
  /// Frequencies that a plan must suit, as factors of the glass's frequency.
  std::array<double, 3> frequencies = {0.97, 1.0, 1.03};
  double price = 200.0;  ///< units of the objective per m of wave above the margin, at each node
  /// (0, 1): the least specific force along the glass's axis, in g. Below it the liquid separates from the glass.
  double least_weight = 0.3;
  double lean_max = 20.0 * M_PI / 180.0;                   ///< rad, (0, pi/2]: of the glass's axis, from the vertical
  bool operator==(const LiquidSettings&) const = default;  ///< compares all members
};

/// The optimal control problem as a profile file states it (profiles/*.yaml), and its terms.
struct OcpSettings {
  int horizon = 8;                  ///< N, intervals, 1..kMaxHorizon
  double dt = 0.05;                 ///< s
  Weights weights;                  ///< an objective that is absent has weight 0
  double velocity_scale = 1.0;      ///< (0, 1], of the robot's velocity limits
  double acceleration_scale = 1.0;  ///< (0, 1], of the robot's acceleration limits
  /// rad (m), margin inside the position limits at the nodes; empty: none.
  JointVector position_margin;
  /// Pairs of a body and an obstacle that one problem sees, the nearest ones; at most kMaxObstacleRows. 0: the problem
  /// has none. The check of the plan covers all pairs: kUsualObstacleRows are enough.
  int obstacle_rows = 0;
  std::optional<LiquidSettings> liquid;                              ///< absent: a problem without liquid
  Objectives objectives = default_objectives();                      ///< at most kMaxObjectives, with different names
  std::vector<ConstraintMaker> constraints = default_constraints();  ///< with different names
};

/// Adds the optional objectives that the weights name and `objectives` lacks.
void add_optional_objectives(OcpSettings& settings);

/// For an arm with more joints than a pose has numbers: adds `posture` if the weights do not name it, with a weight so
/// small that it affects only motions that the other terms leave free.
void add_posture_where_redundant(OcpSettings& settings, const RobotModel& model);

/// Why the liquid is invalid, or Done.
Status check(const LiquidSettings& liquid);

/// States and accelerations over the horizon.
struct Trajectory {
  std::vector<StateVector> x;  ///< N + 1, x_k = [q; dq]
  std::vector<JointVector> u;  ///< N

  Trajectory() = default;
  /// All 0.
  Trajectory(int dof, int horizon) : x(horizon + 1, StateVector::Zero(2 * dof)), u(horizon, JointVector::Zero(dof)) {}
};

/// What changes from one solve to the next. Copying into an instance of the same sizes does not allocate.
struct OcpInstance {
  StateVector x0;                    ///< given state at k = 0
  Reference reference;               ///< for k = 1..N
  std::vector<JointVector> weights;  ///< by index of Ocp::objectives()
  NearObstacles near;                ///< one for each row of the constraint of obstacles
  /// Liquid of each tool, in a problem with a liquid.
  std::array<LiquidInstance, kMaxTools> liquid;
  JointVector u_followed;        ///< rad/s^2, the acceleration that the arm has until node 0; empty: none
  double clearance = 0.0;        ///< m, 0 to kMostClearance, by which bodies stay further apart than asked
  ReferencePoseOf<double> held;  ///< of the second tool in the first, if they hold one thing
  /// Joints whose accelerations stay as the guess has them. Rows without a price that depend on no other joint are no
  /// constraints.
  JointSet given;
};

/// The optimal control problem of docs/explanation/formulation.md as data: minimise dt * sum of objectives subject to
/// the exact double integrator and lower <= constraint rows <= upper. Const after construction; the model must outlive
/// it.
class Ocp {
 public:
  /// With the settings' objectives and constraints. @pre check(settings)
  Ocp(const RobotModel& model, const OcpSettings& settings);
  /// Why the problem is invalid (horizon, dt, more than kMaxObjectives objectives, one that is null, a name that is
  /// no word or is used twice, a number of weights that is none), or Done. Weights are checked by weights().
  static Status check(const OcpSettings& settings);

  const RobotModel& model() const { return *model_; }  ///< the arm
  int dof() const { return model_->dof(); }            ///< n
  int horizon() const { return horizon_; }             ///< N
  double dt() const { return dt_; }                    ///< s
  /// rad (m), see OcpSettings; one for each joint, or none.
  const JointVector& position_margin() const { return position_margin_; }
  /// Liquid of the problem; null if it has none.
  const LiquidSettings* liquid() const { return liquid_ ? &*liquid_ : nullptr; }
  int tool_count() const { return model_->tool_count(); }  ///< of the arm
  /// Numbers of the liquids' states: 0 or kSloshStates for each tool.
  int slosh_states() const { return liquid_ ? kSloshStates * tool_count() : 0; }
  /// Entries of z at a node: [q; dq; u] and the liquids' states.
  int entries() const { return 3 * dof() + slosh_states(); }
  /// Length of OcpInstance::near.
  int obstacle_rows() const { return obstacle_rows_; }

  const Objectives& objectives() const { return objectives_; }  ///< in the order of weights
  /// In the order of Evaluation::rows().
  const std::vector<std::shared_ptr<const Constraint>>& constraints() const { return constraints_; }
  /// True where a term acts at node k = 0..N.
  bool acts(Nodes nodes, int k) const { return nodes == Nodes::kStates ? k > 0 : k < horizon_; }

  /// x_{k+1} of the exact double integrator.
  StateVector next(const StateVector& x, const JointVector& u) const;

  /// The settings' weights in the order of objectives(). Fails on an unknown name, a wrong count, or a weight that is
  /// negative or not finite.
  Result<std::vector<JointVector>> weights(const Weights& by_name) const;
  /// Whether no joint that is not given can change the row: it is no constraint of the instance then. A row with a
  /// price stays one.
  bool is_given(const OcpInstance& instance, ConstraintRow row) const {
    if (instance.given.none()) return false;
    const Constraint& constraint = *constraints_[row.constraint];
    return !std::isfinite(constraint.price(row.row)) &&
           (constraint.joints(row.row, dof(), instance.near) & ~instance.given).none();
  }
  /// Why an instance cannot be solved (sizes, non-finite numbers), or Done. Allocates only when it fails.
  Status check(const OcpInstance& instance) const;

 private:
  const RobotModel* model_;
  int horizon_;
  double dt_;
  JointVector position_margin_;
  int obstacle_rows_;
  std::optional<LiquidSettings> liquid_;
  Objectives objectives_;
  std::vector<std::shared_ptr<const Constraint>> constraints_;
};

}  // namespace steadyhand
