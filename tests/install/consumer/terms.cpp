// Terms of the caller's, one of each kind: between two heights the glass is drawn to a third, and the arm slowed down.
// The hand asks for more than that.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

#include "steadyhand/files.hpp"
#include "steadyhand/planning.hpp"

using namespace steadyhand;

constexpr double kLow = 0.3, kHigh = 0.5, kDrawn = 0.4;  // m

/// w dq'dq, for one node.
struct Slow final : Objective {
  Slow() : Objective({.name = "slow", .label = "Slow", .unit = "s/rad^2"}) {}
  using Objective::add_gradient, Objective::add_hessian, Objective::value;
  Nodes nodes() const override { return Nodes::kStates; }
  double value(const Node& node, const JointVector& weight) const override { return weight[0] * node.dq.squaredNorm(); }
  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    for (int i = 0; i < node.arm.dof(); ++i) gradient[node.arm.dof() + i] += 2.0 * weight[0] * node.dq[i];
  }
  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    for (int i = node.arm.dof(); i < 2 * node.arm.dof(); ++i) hessian(i, i) += 2.0 * weight[0];
  }
};

template <typename S>
void add_height_gradient(const NodeOf<S>& node, const S& scale, NodeGradientOf<S>& gradient) {
  for (int i = 0; i < node.arm.dof(); ++i) gradient[i] += scale * node.arm.dp(i).z();
}
template <typename S>
void add_height_hessian(const NodeOf<S>& node, const S& scale, NodeHessianOf<S>& hessian) {
  for (int j = 0; j < node.arm.dof(); ++j) {
    for (int i = 0; i <= j; ++i) hessian(i, j) += scale * node.arm.d2p(i, j).z();
  }
}

/// w (z - drawn)^2, for one node and for a batch.
struct Drawn final : ObjectiveFor<Drawn> {
  Drawn() : ObjectiveFor({.name = "drawn", .label = "Drawn", .unit = "1/(m^2 s)"}) {}
  Nodes nodes() const override { return Nodes::kStates; }
  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    const S d = node.arm.p().z() - kDrawn;
    return weight[0] * d * d;
  }
  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    add_height_gradient<S>(node, 2.0 * weight[0] * (node.arm.p().z() - kDrawn), gradient);
  }
  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    convex_hessian_at(node, weight, hessian);
    add_height_hessian<S>(node, 2.0 * weight[0] * (node.arm.p().z() - kDrawn), hessian);
  }
  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    for (int j = 0; j < node.arm.dof(); ++j) {
      for (int i = 0; i <= j; ++i) hessian(i, j) += 2.0 * weight[0] * node.arm.dp(i).z() * node.arm.dp(j).z();
    }
  }
};

/// z >= low, for one node and for a batch.
struct Above final : ConstraintFor<Above> {
  Above() : ConstraintFor({"above", "Above", "m"}) {}
  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return 1; }
  Bounds bounds(int) const override { return {kLow, std::numeric_limits<double>::infinity()}; }
  double activation_margin(int) const override { return 0.1; }
  template <typename S>
  S value_at(const NodeOf<S>& node, int) const {
    return node.arm.p().z();
  }
  template <typename S>
  void gradient_at(const NodeOf<S>& node, int, S scale, NodeGradientOf<S>& gradient) const {
    add_height_gradient<S>(node, scale, gradient);
  }
  template <typename S>
  void hessian_at(const NodeOf<S>& node, int, S scale, NodeHessianOf<S>& hessian) const {
    add_height_hessian<S>(node, scale, hessian);
  }
};

/// z <= high, for one node.
struct Below final : Constraint {
  Below() : Constraint({"below", "Below", "m"}) {}
  using Constraint::add_gradient, Constraint::add_hessian, Constraint::value;
  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return 1; }
  Bounds bounds(int) const override { return {-std::numeric_limits<double>::infinity(), kHigh}; }
  double value(const Node& node, int) const override { return node.arm.p().z(); }
  void add_gradient(const Node& node, int, double scale, NodeGradient& gradient) const override {
    add_height_gradient(node, scale, gradient);
  }
  void add_hessian(const Node& node, int, double scale, NodeHessian& hessian) const override {
    add_height_hessian(node, scale, hessian);
  }
};

int main() {
  const Result<RobotModel> robot = open_robot("ur5e");
  const Result<Profile> profile = load_profile("tracking");
  if (!robot || !profile)
    return std::fprintf(stderr, "%s\n", (robot ? profile.error() : robot.error()).message.c_str()), 2;
  PipelineSettings settings(*profile);
  settings.retarget.scale = 1.0;
  settings.ocp.objectives.insert(settings.ocp.objectives.end(), {std::make_shared<Slow>(), std::make_shared<Drawn>()});
  settings.ocp.weights["slow"] = {0.1};
  settings.ocp.weights["drawn"] = {1.0};
  settings.ocp.constraints.push_back([](const auto&, const auto&) { return std::make_shared<Above>(); });
  settings.ocp.constraints.push_back([](const auto&, const auto&) { return std::make_shared<Below>(); });
  auto arm = Pipeline::make(*robot, settings);
  if (!arm) return std::fprintf(stderr, "%s\n", arm.error().message.c_str()), 2;

  Kinematics kinematics(*robot);
  double low = kHigh, high = kLow;
  for (int i = 0; i <= 1500; ++i) {
    const Time now = from_seconds(i / 500.0);
    OperatorSample hand;
    hand.stamp = {now, now};
    hand.X_operator_hand.p.z() = 0.3 * std::sin(2.0 * M_PI * i / 1500.0);
    hand.clutch = true;
    if (!(*arm)->feed(hand)) return 1;
    kinematics.set_position((*arm)->update(now).q);
    low = std::min(low, kinematics.p().z());
    high = std::max(high, kinematics.p().z());
  }
  std::printf("%.3f %.3f\n", low, high);
  return std::abs(low - kLow) < 0.01 && std::abs(high - kHigh) < 0.01 ? 0 : 1;
}
