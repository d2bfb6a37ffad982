#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/planning/ocp/constraints.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"
#include "support/extra_objectives.hpp"

namespace steadyhand {
namespace {

constexpr double kDifference = 1e-5;

/// Joints of a robot: of both arms, then of the left and the right one; with none of these, of its only arm.
struct Joints {
  int shared, left = 0, right = 0;

  int all() const { return shared + left + right; }
};

/// An Evaluation of two intervals whose middle node can be moved along z = [q; dq; u].
struct Fixture {
  using Change = void (*)(RobotModel&, std::mt19937&);

  Fixture(
      const Joints& joints, unsigned seed, Change change = [](RobotModel&, std::mt19937&) {})
      : random_(seed),
        model_(changed_robot(joints, random_, change)),
        ocp_(model_, two_intervals(model_.dof())),
        evaluation_(ocp_) {
    instance_.x0 = StateVector::Zero(2 * model_.dof());
    instance_.reference.nodes = 2;
    for (int t = 0; t < model_.tool_count(); ++t) {
      for (int k = 0; k < 2; ++k) {
        instance_.reference.tools[t].p[k] = 0.5 * Vector3::Random();
        instance_.reference.tools[t].R[k] = Quaternion::UnitRandom().toRotationMatrix();
      }
      reference_[t] = {instance_.reference.tools[t].p[kNode - 1], instance_.reference.tools[t].R[kNode - 1]};
      instance_.liquid[t].model = SloshModel(ocp_.liquid()->glass, ocp_.dt(), ocp_.liquid()->frequencies);
      instance_.liquid[t].room = 5e-3;
    }
    for (const auto& objective : ocp_.objectives()) {
      instance_.weights.push_back(JointVector::Zero(objective->weight_count(model_)));
    }
    const Shape shapes[] = {Shape::sphere(0.2), Shape::capsule(0.3, 0.1), Shape::box({0.2, 0.3, 0.1}, 0.02),
                            Shape::half_space()};
    for (int i = 0; i < kRows; ++i) {
      const int body = i == 0 ? -1 : static_cast<int>(random_() % model_.bodies.size());
      const Placed at{3.0 * Vector3::Random(), Quaternion::UnitRandom().toRotationMatrix()};
      NearObstacle near{body, {shapes[i % std::size(shapes)], at, Vector3::Random(), 0.0, {}}, 0.01 * i, -1};
      if (i % 3 == 1) {  // by what is carried
        near.body = kMaxBodies;
        near.carried = carried(shapes[(i / 3) % 3], i % model_.tool_count());
        if (model_.tool_count() > 1 && i % 2) near.obstacle = carried(shapes[i % 3], 1 - near.carried.tool);
      } else if (i % 3 == 2) {  // by the arm, to what is carried
        near.obstacle = carried(shapes[(i / 3) % 3], i % model_.tool_count());
      }
      const Shape& moved = near.obstacle.carried ? near.obstacle.shape
                           : i % 3 == 1          ? near.carried.shape
                           : body < 0            ? shapes[0]
                                                 : model_.bodies[body].shape;
      if (i % 2 == 1 && moved.corners() > 0) near.corner = static_cast<int>(random_() % moved.corners());
      instance_.near.push_back(near);
    }
    instance_.clearance = 4e-3;
    instance_.held = {0.5 * Vector3::Random(), Quaternion::UnitRandom().toRotationMatrix()};
    evaluation_.set_instance(instance_);
  }

  static Obstacle carried(const Shape& shape, int tool) {
    Obstacle result;
    result.shape = shape;
    result.at = {0.4 * Vector3::Random(), Quaternion::UnitRandom().toRotationMatrix()};
    result.carried = true;
    result.tool = tool;
    return result;
  }

  /// Only objective i counts.
  void weigh(std::size_t i) {
    for (auto& weight : instance_.weights) weight.setZero();
    instance_.weights[i] = random_joints(static_cast<int>(instance_.weights[i].size()), 1.0, random_).cwiseAbs();
  }
  Eigen::VectorXd random_z() {
    const int n = model_.dof();
    Eigen::VectorXd z(ocp_.entries());
    z << random_joints(n, 3.0, random_), random_joints(n, 2.0, random_), random_joints(n, 5.0, random_),
        Eigen::VectorXd::Random(ocp_.slosh_states());
    return z;
  }
  void move(const Eigen::VectorXd& z) {
    const int n = model_.dof();
    dq_ = z.segment(n, n);
    u_ = z.segment(2 * n, n);
    evaluation_.set_node(kNode, z.head(2 * n), u_);
    for (int t = 0; t < model_.tool_count(); ++t)
      evaluation_.set_slosh(kNode, z.segment<kSloshStates>(slosh_begin(n, t)), t);
  }

  Node node() const {
    return {evaluation_.arm(kNode), dq_, u_, reference_.data(), time_, instance_.near, nullptr, nullptr, nullptr, 0.0,
            &instance_.held};
  }

  /// Gradient and Hessian of `value` (a function of nothing, at the node's point) against central differences.
  template <typename Value, typename Gradient, typename Hessian>
  void expect_derivatives(const Value& value, const Gradient& add_gradient, const Hessian& add_hessian) {
    const Eigen::VectorXd z = random_z();
    const auto gradient = [&] {
      NodeGradient g = NodeGradient::Zero(z.size());
      add_gradient(g);
      return g;
    };
    move(z);
    const NodeGradient g = gradient();
    NodeHessian H = NodeHessian::Zero(z.size(), z.size());
    add_hessian(H);
    H = NodeHessian(H.selfadjointView<Eigen::Upper>());
    const double scale = 1.0 + std::abs(value()) + H.norm();
    for (int i = 0; i < z.size(); ++i) {
      Eigen::VectorXd at = z;
      at[i] = z[i] + kDifference;
      move(at);
      const double value_plus = value();
      const NodeGradient g_plus = gradient();
      at[i] = z[i] - kDifference;
      move(at);
      EXPECT_NEAR(g[i], (value_plus - value()) / (2.0 * kDifference), 1e-6 * scale) << "entry " << i;
      EXPECT_LT((H.col(i) - (g_plus - gradient()) / (2.0 * kDifference)).norm(), 1e-6 * scale) << "column " << i;
    }
  }

  static RobotModel changed_robot(const Joints& joints, std::mt19937& random, Change change) {
    const auto& [shared, left, right] = joints;
    RobotModel model = left > 0 ? random_tree(shared, left, right, random) : random_arm(shared, random);
    change(model, random);
    return model;
  }
  static OcpSettings two_intervals(int dof) {
    OcpSettings settings;
    settings.horizon = 2;
    settings.position_margin = JointVector::Constant(dof, 1e-3);
    settings.obstacle_rows = kRows;
    settings.liquid.emplace();
    for (const auto& optional : optional_objectives()) settings.weights[optional->name()] = {1.0};
    add_optional_objectives(settings);
    return settings;
  }

  static constexpr int kNode = 1;  // states and intervals act here
  static constexpr int kRows = 12;
  std::mt19937 random_;
  RobotModel model_;
  Ocp ocp_;
  OcpInstance instance_;
  Evaluation evaluation_;
  std::array<ReferencePoseOf<double>, kMaxTools> reference_;
  JointVector dq_, u_;
  double time_ = kNode * ocp_.dt();
};

class EveryTerm : public testing::TestWithParam<Joints> {};

TEST_P(EveryTerm, ObjectiveDerivatives) {
  Fixture f(GetParam(), GetParam().all());
  for (std::size_t i = 0; i < f.ocp_.objectives().size(); ++i) {
    SCOPED_TRACE(f.ocp_.objectives()[i]->name());
    for (int trial = 0; trial < 40; ++trial) {
      f.weigh(i);
      f.expect_derivatives([&] { return f.evaluation_.objective(f.kNode); },
                           [&](NodeGradient& g) { f.evaluation_.add_objective_gradient(f.kNode, 1.0, g); },
                           [&](NodeHessian& H) { f.evaluation_.add_objective_hessian(f.kNode, 1.0, H); });
    }
  }
}

TEST_P(EveryTerm, ConvexHessianHasNoNegativeEigenvalue) {
  Fixture f(GetParam(), 200 + GetParam().all());
  for (std::size_t i = 0; i < f.ocp_.objectives().size(); ++i) {
    SCOPED_TRACE(f.ocp_.objectives()[i]->name());
    for (int trial = 0; trial < 40; ++trial) {
      f.weigh(i);
      f.move(f.random_z());
      const int size = 3 * f.model_.dof();
      NodeHessian convex = NodeHessian::Zero(size, size), by_eigenvalues = convex;
      f.evaluation_.add_objective_convex_hessian(f.kNode, 1.0, convex);
      f.ocp_.objectives()[i]->Objective::add_convex_hessian(f.node(), f.instance_.weights[i], by_eigenvalues);
      for (const NodeHessian& triangle : {convex, by_eigenvalues}) {
        const NodeHessian H = triangle.selfadjointView<Eigen::Upper>();
        EXPECT_GT(Eigen::SelfAdjointEigenSolver<NodeHessian>(H).eigenvalues().minCoeff(), -1e-10 * (1.0 + H.norm()));
      }
    }
  }
}

TEST_P(EveryTerm, EntryIsTheRowsValue) {
  Fixture f(GetParam(), 300 + GetParam().all());
  int entries = 0;
  for (const ConstraintRow row : f.evaluation_.rows(f.kNode)) {
    const int entry = f.ocp_.constraints()[row.constraint]->entry(row.row);
    if (entry < 0) continue;
    const Eigen::VectorXd z = f.random_z();
    f.move(z);
    EXPECT_EQ(f.evaluation_.constraint(f.kNode, row), z[entry]);
    ++entries;
  }
  EXPECT_EQ(entries, 3 * GetParam().all());
}

TEST_P(EveryTerm, ConstraintDerivatives) {
  Fixture f(GetParam(), 100 + GetParam().all());
  for (const ConstraintRow row : f.evaluation_.rows(f.kNode)) {
    SCOPED_TRACE(f.ocp_.constraints()[row.constraint]->name());
    f.expect_derivatives([&] { return f.evaluation_.constraint(f.kNode, row); },
                         [&](NodeGradient& g) { f.evaluation_.add_constraint_gradient(f.kNode, row, 1.0, g); },
                         [&](NodeHessian& H) { f.evaluation_.add_constraint_hessian(f.kNode, row, 1.0, H); });
  }
}

/// A clearance reduces every gap by the same amount, and nothing else.
TEST(Terms, ClearanceIsTakenFromGaps) {
  Fixture f({6}, 6);
  f.move(f.random_z());
  int gaps = 0;
  for (const ConstraintRow row : f.evaluation_.rows(f.kNode)) {
    const std::string& name = f.ocp_.constraints()[row.constraint]->name();
    const bool gap = name == "self_collision" || (name == "obstacles" && f.instance_.near[row.row].body >= 0);
    f.instance_.clearance = 0.0;
    const double value = f.evaluation_.constraint(f.kNode, row);
    f.instance_.clearance = kMostClearance;
    EXPECT_NEAR(f.evaluation_.constraint(f.kNode, row), value - (gap ? kMostClearance : 0.0), 1e-12) << name;
    gaps += gap;
  }
  EXPECT_GT(gaps, 20);
  f.instance_.clearance = 2.0 * kMostClearance;
  const Status refused = f.ocp_.check(f.instance_);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("clearance is 0.04"), std::string::npos) << refused.error().message;
}

INSTANTIATE_TEST_SUITE_P(Joints, EveryTerm,
                         testing::Values(Joints{1}, Joints{3}, Joints{6}, Joints{8}, Joints{0, 2, 3}, Joints{2, 3, 2}));

class EveryShape : public testing::TestWithParam<Joints> {};
INSTANTIATE_TEST_SUITE_P(Joints, EveryShape, testing::Values(Joints{6}, Joints{1, 3, 2}));

/// Cylinders are left out: of their rims second derivatives are no more than near.
TEST_P(EveryShape, DerivativesOfGapsBetweenBodies) {
  Fixture f(GetParam(), 100, [](RobotModel& model, std::mt19937& random) {
    vary_bodies(model, random);
    std::erase_if(model.pairs, [&](const BodyPair& pair) {
      const auto is_cylinder = [&](int i) { return model.bodies[i].shape.kind == ShapeKind::kCylinder; };
      return is_cylinder(pair.first) || is_cylinder(pair.second);
    });
  });
  int rows = 0;
  for (const ConstraintRow row : f.evaluation_.rows(f.kNode)) {
    const Constraint& constraint = *f.ocp_.constraints()[row.constraint];
    if (constraint.name() == "obstacles") {
      const int body = f.instance_.near[row.row].body;
      if (body >= 0 && body < kMaxBodies && f.model_.bodies[body].shape.kind == ShapeKind::kCylinder) continue;
    } else if (constraint.name() != "self_collision") {
      continue;
    }
    f.expect_derivatives([&] { return f.evaluation_.constraint(f.kNode, row); },
                         [&](NodeGradient& g) { f.evaluation_.add_constraint_gradient(f.kNode, row, 1.0, g); },
                         [&](NodeHessian& H) { f.evaluation_.add_constraint_hessian(f.kNode, row, 1.0, H); });
    ++rows;
  }
  EXPECT_GT(rows, 20);
}

/// FORMULATION: the state terms use nodes 1..N, those with accelerations nodes 0..N-1; a state term must not depend on
/// u.
TEST(Terms, StateTermsIgnoreTheAcceleration) {
  Fixture f({6}, 5);
  for (std::size_t i = 0; i < f.ocp_.objectives().size(); ++i) {
    if (f.ocp_.objectives()[i]->nodes() != Nodes::kStates) continue;
    f.weigh(i);
    Eigen::VectorXd z = f.random_z();
    f.move(z);
    const double before = f.evaluation_.objective(f.kNode);
    z.segment(12, 6) += Eigen::VectorXd::Constant(6, 0.7);
    f.move(z);
    EXPECT_EQ(before, f.evaluation_.objective(f.kNode)) << f.ocp_.objectives()[i]->name();
  }
}

TEST(Terms, OrientationIsTheFrobeniusNorm) {
  Fixture f({6}, 6);
  f.weigh(1);
  f.instance_.weights[1].setConstant(1.7);
  f.move(f.random_z());
  const Matrix3 R = f.evaluation_.arm(f.kNode).R(), R_ref = f.instance_.reference.tools[0].R[f.kNode - 1];
  const double expected =
      f.ocp_.dt() * f.instance_.weights[1][0] * (Matrix3::Identity() - R * R_ref.transpose()).squaredNorm();
  EXPECT_NEAR(f.evaluation_.objective(f.kNode), expected, 1e-12);
}

/// The tool's z alone: turns about it cost nothing.
TEST(Terms, OrientationMayLeaveATurnFree) {
  Fixture f({6}, 6);
  f.weigh(1);
  f.instance_.weights[1] = Vector3(0.0, 0.0, 2.0);
  f.move(f.random_z());
  const Matrix3 R = f.evaluation_.arm(f.kNode).R();
  for (const double turn : {0.0, 1.0, M_PI}) {
    f.instance_.reference.tools[0].R[f.kNode - 1] = R * Eigen::AngleAxisd(turn, Vector3::UnitZ());
    f.evaluation_.set_instance(f.instance_);
    EXPECT_NEAR(f.evaluation_.objective(f.kNode), 0.0, 1e-12);
  }
  f.instance_.reference.tools[0].R[f.kNode - 1] = R * Eigen::AngleAxisd(0.3, Vector3::UnitX());
  f.evaluation_.set_instance(f.instance_);
  EXPECT_NEAR(f.evaluation_.objective(f.kNode), f.ocp_.dt() * 2.0 * 2.0 * (1.0 - std::cos(0.3)), 1e-12);
}

TEST(Weights, BadOnesAreRefusedByName) {
  Fixture f({6}, 7);
  for (const auto& [weights, expected] :
       std::vector<std::pair<std::map<std::string, std::vector<double>>, std::string>>{
           {{{"comfort", {1.0}}}, "unknown term 'comfort'"},
           {{{"lateral", {-1.0}}}, "'lateral' is -1"},
           {{{"velocity", {1.0, 2.0}}}, "'velocity' has 2 numbers"},
           {{{"vertical", {std::nan("")}}}, "'vertical' is nan"}}) {
    const auto result = f.ocp_.weights(weights);
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().message.find(expected), std::string::npos) << result.error().message;
  }
}

/// Accelerations within the first interval's bounds exceed no position limit before node 1, and those beyond the bounds
/// do. If none can avoid it, only the hardest braking is left.
TEST(FirstInterval, IsBoundedJustAsThePositionLimitAsks) {
  std::mt19937 random(3);
  const RobotModel model = random_arm(1, random);
  OcpSettings settings;
  settings.position_margin = JointVector::Constant(1, 5e-3);
  const auto limits = make_acceleration_limits(model, settings);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double most = model.acceleration_max[0], limit = model.position_max[0];
  int narrowed = 0, too_late = 0;
  for (int trial = 0; trial < 100'000; ++trial) {
    const double side = trial % 2 == 0 ? 1.0 : -1.0, room = std::pow(10.0, -6.0 * unit(random)),
                 dq = 2.0 * unit(random);
    StateVector x0(2);
    x0 << side * (limit - room), side * dq;
    // Towards the limit, which is ahead.
    const Bounds bounds = limits->first_bounds(x0, 0);
    const double highest = side > 0.0 ? bounds.upper : -bounds.lower,
                 lowest = side > 0.0 ? bounds.lower : -bounds.upper;
    ASSERT_LT(lowest, highest);
    ASSERT_GE(lowest, -most);
    ASSERT_LE(highest, most);
    const auto way = [&](double u) {  // rad, how far the joint gets within the interval
      const double turn = u < 0.0 ? -dq / u : settings.dt;
      const double t = std::min(turn, settings.dt);
      return dq * t + 0.5 * u * t * t;
    };
    if (2.0 * room >= dq * settings.dt) {  // comes to the limit behind node 1, if at all
      ASSERT_EQ(highest, most);
      continue;
    }
    if (dq * dq > 2.0 * most * room) {  // cannot stop
      ASSERT_LE(highest, -0.99 * most * std::min(1.0, dq * dq / (2.0 * most * (room + 1e-6))));
      ++too_late;
      continue;
    }
    ASSERT_LE(way(lowest + unit(random) * (highest - lowest)), room + 2e-6);
    ++narrowed;
    ASSERT_GT(way(highest + 0.01), room);
  }
  EXPECT_GT(narrowed, 1000);
  EXPECT_GT(too_late, 1000);
}

TEST(OwnTerms, AreWeighedBesideTheOthers) {
  std::mt19937 random(8);
  const RobotModel model = random_arm(6, random);
  const int own = static_cast<int>(default_objectives().size());
  const OcpSettings settings = test::with_objectives(own + 3);
  ASSERT_TRUE(Ocp::check(settings));
  const Ocp ocp(model, settings);
  Evaluation evaluation(ocp);
  OcpInstance instance;
  instance.reference.nodes = 2;
  instance.weights = *ocp.weights(settings.weights);
  evaluation.set_instance(instance);
  Trajectory trajectory(6, 2);
  trajectory.x[1].tail(6).setConstant(0.5);
  trajectory.x[2].tail(6).setConstant(-1.0);
  evaluation.set_trajectory(trajectory);
  for (int i = own; i < own + 3; ++i) EXPECT_NEAR(evaluation.objective_share(i), ocp.dt() * (i + 1) * 6 * 1.25, 1e-12);
}

TEST(OwnTerms, AConstraintOfTheCallersActsBesideTheOthers) {
  class Upright final : public Constraint {  // E's z axis keeps some height
   public:
    Upright() : Constraint({.name = "upright", .label = "Upright", .unit = "1"}) {}
    Nodes nodes() const override { return Nodes::kStates; }
    int rows() const override { return 1; }
    Bounds bounds(int /*row*/) const override { return {0.9, 1.0}; }
    double value(const Node& node, int /*row*/) const override { return node.arm.R()(2, 2); }
    void add_gradient(const Node&, int, double, NodeGradient&) const override {}
    void add_hessian(const Node&, int, double, NodeHessian&) const override {}
    using Constraint::add_gradient, Constraint::add_hessian, Constraint::value;
  };
  std::mt19937 random(8);
  const RobotModel model = random_arm(6, random);
  OcpSettings settings = Fixture::two_intervals(6);
  settings.constraints.push_back([](const RobotModel&, const OcpSettings&) { return std::make_shared<Upright>(); });
  settings.constraints.push_back([](const RobotModel&, const OcpSettings&) { return nullptr; });  // not for this robot
  const Ocp ocp(model, settings);
  ASSERT_EQ(ocp.constraints().size(), 10u);
  const Evaluation evaluation(ocp);
  EXPECT_EQ(evaluation.rows(1).back().constraint, 9);
  EXPECT_EQ(evaluation.bounds(1, evaluation.rows(1).back()).lower, 0.9);
}

TEST(OwnTerms, ListsThatAreNoProblemAreRefused) {
  EXPECT_TRUE(Ocp::check(test::with_objectives(kMaxObjectives)));
  const auto expect_refused = [](const OcpSettings& settings, const std::string& why) {
    const Status status = Ocp::check(settings);
    ASSERT_FALSE(status) << why;
    EXPECT_NE(status.error().message.find(why), std::string::npos) << status.error().message;
  };
  expect_refused(test::with_objectives(kMaxObjectives + 1), "17 objectives; a problem has at most 16");
  OcpSettings settings = test::with_objectives(static_cast<int>(default_objectives().size()) + 1);
  settings.objectives.push_back(settings.objectives.back());
  expect_refused(settings, "two are called '" + settings.objectives.back()->name() + "'");
  settings.objectives.back() = nullptr;
  expect_refused(settings, "one is null");
  for (const char* name : {"", "9th", "Speed", "a b", "a,b", "_a", "\xc3\xa4"}) {
    settings.objectives.back() = std::make_shared<test::Extra>(name);
    expect_refused(settings, "is no name");
  }
  for (const int weights : {0, kMaxJoints + 1}) {
    settings.objectives.back() = std::make_shared<test::Extra>("odd", weights);
    expect_refused(settings, "'odd' has " + std::to_string(weights) + " weights; it must be from 1 to 16");
  }
  settings = {};
  settings.constraints.push_back(nullptr);
  expect_refused(settings, "constraints: one is null");
  settings = {};
  settings.horizon = 0;
  expect_refused(settings, "horizon is 0");
  settings = {};
  for (const double dt : {std::nan(""), 0.0, 10.1, std::numeric_limits<double>::infinity()}) {
    settings.dt = dt;
    expect_refused(settings, "; it must be above 0, to 10 s");
  }
  for (const double scale : {std::nan(""), 0.0, -1.0, 1.5}) {
    settings = {};
    settings.velocity_scale = scale;
    expect_refused(settings, "velocity_scale is " + fmt::format("{}; it must be above 0, to 1", scale));
    settings = {};
    settings.acceleration_scale = scale;
    expect_refused(settings, "acceleration_scale is " + fmt::format("{}; it must be above 0, to 1", scale));
  }
}

}  // namespace
}  // namespace steadyhand
