#pragma once

#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/planning/ocp/settings.hpp"
#include "steadyhand/planning/ocp/term.hpp"

namespace steadyhand {

/// States and accelerations over the horizon.
struct Trajectory {
  std::vector<StateVector> x;  ///< N + 1, x_k = [q; dq]
  std::vector<JointVector> u;  ///< N

  Trajectory() = default;
  Trajectory(int dof, int horizon) : x(horizon + 1, StateVector::Zero(2 * dof)), u(horizon, JointVector::Zero(dof)) {}
};

/// Why there is no such liquid, or Done.
Status check(const LiquidSettings& liquid);

/// What changes from one solve to the next. Copying into an instance of the same sizes does not allocate.
struct OcpInstance {
  StateVector x0;                    ///< given state at k = 0
  Reference reference;               ///< for k = 1..N
  std::vector<JointVector> weights;  ///< by index of Ocp::objectives()
  NearObstacles near;                ///< one for each row of the constraint of obstacles
  LiquidInstance liquid;             ///< in a problem with a liquid
  JointVector u_followed;            ///< rad/s^2, the acceleration that the arm has until node 0; empty: none
  double clearance = 0.0;            ///< m, 0 to kMostClearance, by which bodies stay further apart than asked
};

/// The optimal control problem of docs/explanation/formulation.md as data: minimise dt * sum of objectives subject to
/// the exact double integrator and lower <= constraint rows <= upper. Const after construction; the model must outlive
/// it.
class Ocp {
 public:
  /// With the settings' objectives and constraints. @pre check(settings)
  Ocp(const RobotModel& model, const OcpSettings& settings);
  /// Why there is no such problem (horizon, dt, more than kMaxObjectives objectives, one that is null, a name that is
  /// no word or is used twice, a number of weights that is none), or Done. Weights are checked by weights().
  static Status check(const OcpSettings& settings);

  const RobotModel& model() const { return *model_; }
  int dof() const { return model_->dof(); }
  int horizon() const { return horizon_; }
  double dt() const { return dt_; }
  /// rad (m), see OcpSettings; one for each joint, or none.
  const JointVector& position_margin() const { return position_margin_; }
  /// What the problem was made for; null if it knows no liquid.
  const LiquidSettings* liquid() const { return liquid_ ? &*liquid_ : nullptr; }
  /// Numbers of the liquid's state: 0 or kSloshStates.
  int slosh_states() const { return liquid_ ? kSloshStates : 0; }
  /// Entries of z at a node: [q; dq; u] and the liquid's state.
  int entries() const { return 3 * dof() + slosh_states(); }
  /// Length of OcpInstance::near.
  int obstacle_rows() const { return obstacle_rows_; }

  const Objectives& objectives() const { return objectives_; }
  const std::vector<std::shared_ptr<const Constraint>>& constraints() const { return constraints_; }
  /// True where a term acts at node k = 0..N.
  bool acts(Nodes nodes, int k) const { return nodes == Nodes::kStates ? k > 0 : k < horizon_; }

  /// x_{k+1} of the exact double integrator.
  StateVector next(const StateVector& x, const JointVector& u) const;

  /// The settings' weights in the order of objectives(). Fails on an unknown name, a wrong count, or a weight that is
  /// negative or not finite.
  Result<std::vector<JointVector>> weights(const Weights& by_name) const;
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
