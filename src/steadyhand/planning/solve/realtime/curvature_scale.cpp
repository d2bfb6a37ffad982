#include "steadyhand/planning/solve/realtime/curvature_scale.hpp"

namespace steadyhand::realtime {
namespace {

/// Mean curvature of one node's Hessian as seen by an acceleration some steps before.
double seen_by_acceleration(const NodeHessian& H, int n, double dt) {
  constexpr double kSteps = 8.0, kSumOfSquares = 170.0;  // sum of k^2, k = 1..8
  const double by_q = H.diagonal().head(n).mean(), by_v = H.diagonal().segment(n, n).mean();
  const double by_u = H.diagonal().tail(n).mean();
  return by_u + kSteps * dt * dt * by_v + kSumOfSquares * dt * dt * dt * dt * by_q;
}

/// What each weight of each objective adds to that curvature, at the robot's home.
std::vector<JointVector> unit_curvatures(const Ocp& ocp) {
  const int n = ocp.dof();
  OcpInstance unit;
  unit.x0 = StateVector::Zero(2 * n);
  unit.x0.head(n) = ocp.model().home;
  unit.reference.nodes = ocp.horizon();
  for (ToolReference& reference : unit.reference.tools) {
    reference.p.fill(Vector3::Zero());
    reference.R.fill(Matrix3::Identity());
  }
  for (const auto& objective : ocp.objectives())
    unit.weights.push_back(JointVector::Zero(objective->weight_count(ocp.model())));
  Evaluation evaluation(ocp);
  evaluation.set_instance(unit);
  evaluation.set_node(0, unit.x0, JointVector::Zero(n));
  evaluation.set_node(1, unit.x0, JointVector::Zero(n));

  std::vector<JointVector> result = unit.weights;
  for (std::size_t i = 0; i < result.size(); ++i) {
    for (int j = 0; j < result[i].size(); ++j) {
      unit.weights[i][j] = 1.0;
      NodeHessian H = NodeHessian::Zero(3 * n, 3 * n);
      evaluation.add_objective_convex_hessian(ocp.acts(ocp.objectives()[i]->nodes(), 0) ? 0 : 1, 1.0, H);
      result[i][j] = seen_by_acceleration(H, n, ocp.dt());
      unit.weights[i][j] = 0.0;
    }
  }
  return result;
}

}  // namespace

CurvatureScale::CurvatureScale(const Ocp& ocp) : unit_(unit_curvatures(ocp)) {}

double CurvatureScale::of(const std::vector<JointVector>& weights) const {
  double scale = 0.0;
  for (std::size_t i = 0; i < unit_.size(); ++i) scale += unit_[i].dot(weights[i]);
  return scale == 0.0 ? 1.0 : scale;
}

}  // namespace steadyhand::realtime
