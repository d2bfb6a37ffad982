// An objective of one's own, in one's own file: the glass keeps above a table that the arm knows nothing of. The same
// hand, which reaches below the table, is followed without and with it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "steadyhand/files.hpp"
#include "steadyhand/planning.hpp"

using namespace steadyhand;

/// w d^2, where d is how far the controlled frame is below the height; 0 above it.
class AboveTable final : public Objective {
 public:
  explicit AboveTable(double height)
      : Objective({.name = "above_table", .label = "Above the table", .unit = "1/(m^2 s)", .range = {1.0, 1e5, true}}),
        height_(height) {}

  Nodes nodes() const override { return Nodes::kStates; }

  double value(const Node& node, const JointVector& weight) const override {
    const double d = depth(node);
    return weight[0] * d * d;
  }
  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    const double d = depth(node);
    for (int i = 0; i < node.arm.dof(); ++i) gradient[i] -= 2.0 * weight[0] * d * node.arm.dp(i).z();
  }
  /// Of both Hessians the upper triangle counts.
  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    add_convex_hessian(node, weight, hessian);
    const double d = depth(node);
    for (int j = 0; j < node.arm.dof(); ++j) {
      for (int i = 0; i <= j; ++i) hessian(i, j) -= 2.0 * weight[0] * d * node.arm.d2p(i, j).z();
    }
  }
  /// Gauss-Newton: of a sum of squares, what is never negative.
  void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    if (depth(node) == 0.0) return;
    for (int j = 0; j < node.arm.dof(); ++j) {
      for (int i = 0; i <= j; ++i) hessian(i, j) += 2.0 * weight[0] * node.arm.dp(i).z() * node.arm.dp(j).z();
    }
  }
  using Objective::add_convex_hessian, Objective::add_gradient, Objective::add_hessian, Objective::value;

 private:
  double depth(const Node& node) const { return std::max(0.0, height_ - node.arm.p().z()); }

  double height_;  // m, base frame
};

/// How low the glass comes, m, when the hand goes 0.3 m down and up again in 4 s.
Result<double> lowest(const RobotModel& robot, const PipelineSettings& settings) {
  const auto made = Pipeline::make(robot, settings);
  if (!made) return made.error();
  Pipeline& arm = **made;
  Kinematics kinematics(robot);
  double lowest = 10.0;
  for (Time now{0}; now < from_seconds(4.0); now += from_seconds(0.01)) {
    const double down = 0.15 * (1.0 - std::cos(2.0 * M_PI * to_seconds(now) / 4.0));
    if (Status s = arm.feed({{now, now}, {Vector3(0.0, 0.0, -down), Quaternion::Identity()}, true}); !s)
      return s.error();
    kinematics.set_position(arm.update(now).q);
    lowest = std::min(lowest, kinematics.p().z());
  }
  return lowest;
}

int main() {
  const auto fail = [](const Error& error) {
    fmt::print(stderr, "{}\n", error.message);
    return 2;
  };
  const Result<RobotModel> robot = open_robot("ur5e");
  if (!robot) return fail(robot.error());
  const Result<Profile> profile = load_profile("tracking");
  if (!profile) return fail(profile.error());
  Kinematics kinematics(*robot);
  kinematics.set_position(robot->home);
  const double table = kinematics.p().z() - 0.1;

  PipelineSettings settings(*profile);
  settings.retarget.scale = 1.0;
  const Result<double> without = lowest(*robot, settings);
  if (!without) return fail(without.error());

  settings.ocp.objectives.push_back(std::make_shared<AboveTable>(table));
  settings.ocp.weights["above_table"] = {2e4};
  const Result<double> with = lowest(*robot, settings);
  if (!with) return fail(with.error());

  fmt::print("table at {:.3f} m; the hand goes down to {:.3f} m\n", table, kinematics.p().z() - 0.3);
  fmt::print("the glass comes down to {:.3f} m without the objective, to {:.3f} m with it\n", *without, *with);
  return *without < table - 0.15 && *with > table - 0.015 ? 0 : 1;
}
