#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/planning/ocp/slosh.hpp"

namespace steadyhand {

/// Derivatives at one node are taken by z = [q; dq; u], 3n, and behind them the state of each tool's liquid if the
/// problem has liquid.
template <typename Scalar>
using NodeGradientOf = Eigen::Matrix<Scalar, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxEntries, 1>;
using NodeGradient = NodeGradientOf<double>;  ///< at one node
/// Only the upper triangle (row <= column) counts.
template <typename Scalar>
using NodeHessianOf = MotionHessianOf<Scalar>;
using NodeHessian = NodeHessianOf<double>;  ///< at one node

/// A body of the arm, or an object that a tool carries, and an obstacle that it may come near, or an object that
/// another tool carries (Obstacle::carried). The time is that of the instance's node 0.
struct NearObstacle {
  /// Body of the model; from kMaxBodies on, `carried` in its place; -1: none, and the other members are not used.
  int body = -1;
  Obstacle obstacle;   ///< the obstacle
  double depth = 0.0;  ///< m, that the row may be below its bound: as much as it is at node 0
  /// The ball around one corner of the core (Shape::corner) of the moving body or carried object; -1: the whole. When a
  /// flat or long body lies along a flat obstacle, the nearest corner changes and the gradient jumps; a row for each
  /// corner does not.
  int corner = -1;
  Obstacle carried{};  ///< by the tool
};
/// Rows that the constraint of obstacles has for them (OcpSettings::obstacle_rows).
using NearObstacles = std::vector<NearObstacle>;

/// Where a tool is to be.
template <typename Scalar>
struct ReferencePoseOf {
  Vector3Of<Scalar> p = Vector3Of<Scalar>::Zero();      ///< m, base frame
  Matrix3Of<Scalar> R = Matrix3Of<Scalar>::Identity();  ///< tool to base
};

/// The input of a term at one node of the horizon, or (Scalar = Lanes) at kLanes of them.
template <typename Scalar>
struct NodeOf {
  const KinematicsOf<Scalar>& arm;                ///< at q; with the motion (dq, u) where the term acts on intervals
  const JointVectorOf<Scalar>& dq;                ///< rad/s (m/s)
  const JointVectorOf<Scalar>& u;                 ///< ddq, rad/s^2 (m/s^2)
  const ReferencePoseOf<Scalar>* reference;       ///< of each tool
  const Scalar& time;                             ///< s, since node 0
  const NearObstacles& near;                      ///< obstacles of the instance
  const SloshStateOf<Scalar>* slosh = nullptr;    ///< states of each tool's liquid; null in a problem without liquid
  const LiquidInstance* liquid = nullptr;         ///< liquid of each tool; null likewise
  const JointVector* u_followed = nullptr;        ///< acceleration of the arm until node 0
  double clearance = 0.0;                         ///< m, clearance of the instance
  const ReferencePoseOf<double>* held = nullptr;  ///< OcpInstance::held
};
using Node = NodeOf<double>;  ///< one

/// One node of the horizon per lane.
struct NodeBatch : NodeOf<Lanes> {
  Kinematics& scratch;  ///< for terms that know one node only
};

/// Where on the horizon a term acts. The state x_0 is given, so what depends on the state alone begins at k = 1.
enum class Nodes {
  kStates,     ///< k = 1..N; must not use u
  kIntervals,  ///< k = 0..N-1
};

/// Range of weights that a page offers to its operator.
struct WeightRange {
  double min = 0.0;          ///< least
  double max = 100.0;        ///< most
  bool logarithmic = false;  ///< by factors from min > 0 on, and 0 at the lower end
};

/// How many weights an objective has.
struct WeightCount {
  /// For each of what there is a set of weights.
  enum class Of { kProblem, kTool, kJoint };
  int each = 1;          ///< in a set
  Of of = Of::kProblem;  ///< one set, or one for each tool or joint
  /// In all, for this robot.
  int in(const RobotModel& model) const {
    return each * (of == Of::kJoint ? model.dof() : of == Of::kTool ? model.tool_count() : 1);
  }
};

/// Name and weights of an objective. They are defined in the objective's file: profiles, logs, reports, messages and
/// pages take them from there.
struct ObjectiveInfo {
  std::string name;          ///< lower-case letters, digits and underscores, the first a letter
  std::string label;         ///< for people
  std::string unit;          ///< unit of a weight
  WeightCount weights = {};  ///< how many; in all at most kMaxJoints
  WeightRange range = {};    ///< to choose from
  bool offered = true;       ///< pages offer the weight to the operator of a live arm
  bool ties_tools = false;   ///< with a weight the two tools hold one thing: where one goes, the other goes too
  double at_rest_min = 0.0;  ///< while the arm only stops, its weights are the profile's, but not below this
  /// and not above this: terms that move the arm to a place have 0.
  double at_rest_max = std::numeric_limits<double>::infinity();
};

/// The same of a constraint.
struct ConstraintInfo {
  std::string name;   ///< see ObjectiveInfo
  std::string label;  ///< for people
  std::string unit;   ///< unit of its rows
};

/// One summand of the stage cost, linear in its weights. Const in the loop; the solver multiplies by dt.
///
/// A user's class passes its ObjectiveInfo to the constructor and defines nodes(), and value, gradient and Hessian at
/// one node. Add it to OcpSettings::objectives.
///
/// Each function exists for one node and for a batch of nodes. The functions for batches are optional: without them the
/// nodes are computed one after another. Terms of this project are written once for both, see ObjectiveFor.
class Objective {
 public:
  virtual ~Objective() = default;
  const ObjectiveInfo& info() const { return info_; }     ///< name, unit and the like
  const std::string& name() const { return info_.name; }  ///< in profiles, logs and reports
  virtual Nodes nodes() const = 0;                        ///< where it acts
  /// Number of weights.
  int weight_count(const RobotModel& model) const { return info_.weights.in(model); }
  /// Whether it uses the arm's motion (velocities, accelerations of the tool).
  virtual bool needs_motion() const { return nodes() == Nodes::kIntervals; }
  /// Whether for given q and dq the value is a convex quadratic function of u, whose Hessian add_convex_hessian()
  /// gives: then node 0, whose state is given, is computed once for all iterates.
  virtual bool quadratic_in_input() const { return false; }

  /// Its part of the stage cost.
  virtual double value(const Node& node, const JointVector& weight) const = 0;
  /// Adds its derivative by z.
  virtual void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const = 0;
  /// Exact, upper triangle.
  virtual void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const = 0;
  /// A positive semidefinite approximation of the Hessian, for iterates where the exact one is not usable: Gauss-Newton
  /// where the term is a sum of squares. The default takes the positive eigenvalues of the exact one.
  virtual void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const;

  using BatchWeight = JointVectorOf<Lanes>;  ///< weight of each lane's node
  /// @{ The same for a batch.
  virtual Lanes value(const NodeBatch& nodes, const BatchWeight& weight) const;
  virtual void add_gradient(const NodeBatch& nodes, const BatchWeight& weight, NodeGradientOf<Lanes>& gradient) const;
  virtual void add_hessian(const NodeBatch& nodes, const BatchWeight& weight, NodeHessianOf<Lanes>& hessian) const;
  virtual void add_convex_hessian(const NodeBatch& nodes, const BatchWeight& weight,
                                  NodeHessianOf<Lanes>& hessian) const;
  /// @}

 protected:
  /// Takes name, unit and the like.
  explicit Objective(ObjectiveInfo info) : info_(std::move(info)) {}

 private:
  ObjectiveInfo info_;
};

/// An objective written once for one node and for a batch: Term has the members
///   Scalar value_at<Scalar>(const NodeOf<Scalar>&, const JointVectorOf<Scalar>& weight) const,
///   void gradient_at<Scalar>(same, NodeGradientOf<Scalar>&) const, hessian_at and convex_hessian_at likewise.
template <typename Term>
class ObjectiveFor : public Objective {
 public:
  /// @{ By Term's members.
  double value(const Node& node, const JointVector& weight) const final { return term().value_at(node, weight); }
  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const final {
    term().gradient_at(node, weight, gradient);
  }
  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const final {
    term().hessian_at(node, weight, hessian);
  }
  void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const final {
    term().convex_hessian_at(node, weight, hessian);
  }
  Lanes value(const NodeBatch& nodes, const BatchWeight& weight) const final {
    return term().template value_at<Lanes>(nodes, weight);
  }
  void add_gradient(const NodeBatch& nodes, const BatchWeight& weight, NodeGradientOf<Lanes>& gradient) const final {
    term().template gradient_at<Lanes>(nodes, weight, gradient);
  }
  void add_hessian(const NodeBatch& nodes, const BatchWeight& weight, NodeHessianOf<Lanes>& hessian) const final {
    term().template hessian_at<Lanes>(nodes, weight, hessian);
  }
  void add_convex_hessian(const NodeBatch& nodes, const BatchWeight& weight,
                          NodeHessianOf<Lanes>& hessian) const final {
    term().template convex_hessian_at<Lanes>(nodes, weight, hessian);
  }
  /// @}

 protected:
  using Objective::Objective;

 private:
  const Term& term() const { return static_cast<const Term&>(*this); }
};

/// Bounds of a row; infinite where there is none.
struct Bounds {
  double lower;  ///< in the row's unit
  double upper;  ///< the same
};

/// Entries first .. last - 1 of z.
struct EntryRange {
  int first;  ///< index in z
  int last;   ///< one behind
};

/// Scalar rows c_i(z) with lower <= c_i <= upper. Holds what it needs of the robot; const in the loop. One node or a
/// batch, as for Objective.
class Constraint {
 public:
  virtual ~Constraint() = default;
  const ConstraintInfo& info() const { return info_; }    ///< name, unit and the like
  const std::string& name() const { return info_.name; }  ///< in logs and reports
  virtual Nodes nodes() const = 0;                        ///< where it acts
  virtual int rows() const = 0;                           ///< how many
  virtual Bounds bounds(int row) const = 0;               ///< of one of them
  /// The row's bounds at node 0, whose state is given and may move those that are finite.
  virtual Bounds first_bounds(const StateVector& /*x0*/, int row) const { return bounds(row); }

  virtual double value(const Node& node, int row) const = 0;  ///< c_row
  /// Adds scale * dc_row/dz.
  virtual void add_gradient(const Node& node, int row, double scale, NodeGradient& gradient) const = 0;
  /// Adds scale * d2c_row/dz2, upper triangle. Linear rows add nothing.
  virtual void add_hessian(const Node& node, int row, double scale, NodeHessian& hessian) const = 0;

  /// c_row at each node of a batch.
  virtual Lanes value(const NodeBatch& nodes, int row) const;
  /// Sets near[i] for every row i that is within its activation margin or beyond its bounds in a lane where `acts` is
  /// not 0, and perhaps for others. The only call made for every row.
  virtual void find_near(const NodeBatch& nodes, Lanes acts, char* near) const;
  /// @{ As for one node.
  virtual void add_gradient(const NodeBatch& nodes, int row, Lanes scale, NodeGradientOf<Lanes>& gradient) const;
  virtual void add_hessian(const NodeBatch& nodes, int row, Lanes scale, NodeHessianOf<Lanes>& hessian) const;
  /// @}

  /// Index in z when the row's value is that entry of z and nothing else, else -1: limits, which solvers treat apart.
  virtual int entry(int /*row*/) const { return -1; }
  /// Entries of z that the row may depend on, for an arm of n joints. The states of the liquids begin at 3n.
  virtual EntryRange support(int /*row*/, int dof) const { return {0, 3 * dof}; }
  /// Joints whose motion the row depends on, with these obstacles: a row of joints that are all given
  /// (OcpInstance::given) is no constraint. The default takes those of its support.
  virtual JointSet joints(int row, int dof, const NearObstacles& near) const;
  /// Units of the objective per unit of the row that leaving the row's bounds costs. Infinite: it may not leave them.
  virtual double price(int /*row*/) const { return std::numeric_limits<double>::infinity(); }
  /// A solver may leave out a row whose value is further than this inside its bounds on the guess, if it checks all
  /// rows at its solution. Infinite: never leave it out. In the row's unit.
  virtual double activation_margin(int /*row*/) const { return std::numeric_limits<double>::infinity(); }
  /// How fast its rows may use up their margins: a row that is outside its activation margin for some q is inside its
  /// bounds for every q' with sum_j lever_j |q'_j - q_j| <= 1, for all dq and u. 1/rad (1/m), one for each joint;
  /// empty: unknown, and a solver computes all rows. Called at set-up.
  virtual JointVector levers() const { return {}; }

 protected:
  /// Takes name, unit and the like.
  explicit Constraint(ConstraintInfo info) : info_(std::move(info)) {}

 private:
  ConstraintInfo info_;
};

/// One scalar inequality of a node: row `row` of constraint `constraint`.
struct ConstraintRow {
  int constraint;  ///< index in Ocp::constraints()
  int row;         ///< below Constraint::rows()
};

/// A constraint written once for one node and for a batch: Term has value_at, gradient_at and hessian_at.
template <typename Term>
class ConstraintFor : public Constraint {
 public:
  /// @{ By Term's members.
  double value(const Node& node, int row) const final { return term().value_at(node, row); }
  void add_gradient(const Node& node, int row, double scale, NodeGradient& gradient) const final {
    term().gradient_at(node, row, scale, gradient);
  }
  void add_hessian(const Node& node, int row, double scale, NodeHessian& hessian) const final {
    term().hessian_at(node, row, scale, hessian);
  }
  Lanes value(const NodeBatch& nodes, int row) const final { return term().template value_at<Lanes>(nodes, row); }
  void add_gradient(const NodeBatch& nodes, int row, Lanes scale, NodeGradientOf<Lanes>& gradient) const final {
    term().template gradient_at<Lanes>(nodes, row, scale, gradient);
  }
  void add_hessian(const NodeBatch& nodes, int row, Lanes scale, NodeHessianOf<Lanes>& hessian) const final {
    term().template hessian_at<Lanes>(nodes, row, scale, hessian);
  }
  /// @}

 protected:
  using Constraint::Constraint;

 private:
  const Term& term() const { return static_cast<const Term&>(*this); }
};

}  // namespace steadyhand
