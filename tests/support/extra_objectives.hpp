#pragma once

#include <fmt/format.h>

#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand::test {

/// w dq' dq with the first weight, as a user's own term would be: at single nodes.
class Extra : public Objective {
 public:
  explicit Extra(std::string name, int weights = 1)
      : Objective({.name = std::move(name), .label = "Extra", .unit = "s/rad^2", .weights = {weights}}) {}
  Nodes nodes() const override { return Nodes::kStates; }
  double value(const Node& node, const JointVector& weight) const override { return weight[0] * node.dq.squaredNorm(); }
  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    const int n = node.arm.dof();
    gradient.segment(n, n) += 2.0 * weight[0] * node.dq;
  }
  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    const int n = node.arm.dof();
    hessian.diagonal().segment(n, n).array() += 2.0 * weight[0];
  }
  using Objective::add_gradient, Objective::add_hessian, Objective::value;
};

/// Two intervals, the default objectives and as many extra ones, extra_6 and so on, as make `count`; of weight i + 1
/// each.
inline OcpSettings with_objectives(int count) {
  OcpSettings settings;
  settings.horizon = 2;
  for (int i = static_cast<int>(settings.objectives.size()); i < count; ++i) {
    settings.objectives.push_back(std::make_shared<Extra>(fmt::format("extra_{}", i)));
    settings.weights[settings.objectives.back()->name()] = {i + 1.0};
  }
  return settings;
}

}  // namespace steadyhand::test
