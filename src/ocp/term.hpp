#pragma once

#include <limits>
#include <string_view>

#include "core/math.hpp"
#include "robot/kinematics.hpp"

namespace steadyhand {

/// Derivatives at one node are taken by z = [q; dq; u], 3n.
using NodeGradient = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 3 * kMaxJoints, 1>;
using NodeHessian = MotionHessian;

/// What a term sees at one node of the horizon.
struct Node {
  const Kinematics& arm;  ///< at q; with the motion (dq, u) where the term acts on intervals
  const JointVector& dq;
  const JointVector& u;
  const Vector3& p_ref;  ///< m, base frame
  const Matrix3& R_ref;  ///< tool to base
};

/// Where on the horizon a term acts. The state x_0 is given, so what depends on the state alone begins at k = 1.
enum class Nodes {
  kStates,     ///< k = 1..N; must not use u
  kIntervals,  ///< k = 0..N-1
};

/// One summand of the stage cost, linear in its weights. Stateless; the solver multiplies by dt.
class Objective {
 public:
  virtual ~Objective() = default;
  /// The one name that it has in code, profile, log, report and page.
  virtual std::string_view name() const = 0;
  virtual Nodes nodes() const = 0;
  /// Number of weights for an arm of n joints, at most kMaxJoints.
  virtual int weight_count(int dof) const = 0;

  virtual double value(const Node& node, const JointVector& weight) const = 0;
  virtual void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const = 0;
  /// Exact, both triangles.
  virtual void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const = 0;
  /// A positive semidefinite stand-in for the Hessian, for iterates where the exact one is of no use: Gauss-Newton
  /// where the term is a sum of squares. The default takes the positive eigenvalues of the exact one.
  virtual void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const;

 protected:
  Objective() = default;
};

struct Bounds {
  double lower, upper;  ///< infinite where there is none
};

/// Scalar rows c_i(z) with lower <= c_i <= upper. Holds what it needs of the robot; const in the loop.
class Constraint {
 public:
  virtual ~Constraint() = default;
  virtual std::string_view name() const = 0;
  virtual Nodes nodes() const = 0;
  virtual int rows() const = 0;
  virtual Bounds bounds(int row) const = 0;

  virtual double value(const Node& node, int row) const = 0;
  /// Adds scale * dc_row/dz.
  virtual void add_gradient(const Node& node, int row, double scale, NodeGradient& gradient) const = 0;
  /// Adds scale * d2c_row/dz2, both triangles. Linear rows add nothing.
  virtual void add_hessian(const Node& node, int row, double scale, NodeHessian& hessian) const = 0;
  /// Index in z when the row's value is that entry of z and nothing else, else -1: limits, which solvers treat apart.
  virtual int entry(int /*row*/) const { return -1; }
  /// A solver may leave out a row whose value is further than this inside its bounds on the guess, if it checks all
  /// rows at its solution. Infinite: never leave it out. In the row's unit.
  virtual double watch_margin(int /*row*/) const { return std::numeric_limits<double>::infinity(); }

 protected:
  Constraint() = default;
};

}  // namespace steadyhand
