#pragma once

#include <array>
#include <vector>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/planning/ocp/term.hpp"

namespace steadyhand {

/// The entry of a symmetric matrix of which the upper triangle counts.
auto& upper_entry(auto& hessian, int i, int j) { return i <= j ? hessian(i, j) : hessian(j, i); }

inline JointSet joints_of(const std::vector<SignedJoint>& way) {
  JointSet joints;
  for (const auto& [m, sign] : way) joints.set(m);
  return joints;
}

/// Adds scale times the second derivatives of near.value by the joints on the way from the first solid to the second.
template <typename Scalar>
void add_second_derivatives(const NodeOf<Scalar>& node, const ProximityOf<Scalar>& near,
                            const std::vector<SignedJoint>& way, Scalar scale, NodeHessianOf<Scalar>& hessian) {
  std::array<MovedOf<Scalar>, kMaxJoints> moved;
  for (const auto& [m, sign] : way) moved[m] = {near, sign * node.arm.axis(m), sign * node.arm.dpoint(m, near.point)};
  for (auto m = way.begin(); m != way.end(); ++m) {
    for (auto l = way.begin(); l <= m; ++l)
      upper_entry(hessian, l->joint, m->joint) += scale * second_derivative(near, moved[l->joint], moved[m->joint]);
  }
}

}  // namespace steadyhand
