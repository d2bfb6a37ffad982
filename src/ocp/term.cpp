#include "ocp/term.hpp"

#include <Eigen/Eigenvalues>

namespace steadyhand {

void Objective::add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const {
  const int size = 3 * node.arm.dof();
  NodeHessian exact = NodeHessian::Zero(size, size);
  add_hessian(node, weight, exact);
  const Eigen::SelfAdjointEigenSolver<NodeHessian> eigen(exact);
  for (int i = 0; i < size; ++i) {
    const auto v = eigen.eigenvectors().col(i);
    if (eigen.eigenvalues()[i] > 0.0) hessian.noalias() += eigen.eigenvalues()[i] * v.lazyProduct(v.transpose());
  }
}

}  // namespace steadyhand
