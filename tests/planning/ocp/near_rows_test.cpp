#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {
namespace {

/// Least distance to the bounds of a row, less its activation margin, in any lane that counts.
double beyond_margin(const Constraint& constraint, const NodeBatch& nodes, int row, int lanes) {
  const Lanes value = constraint.value(nodes, row);
  const Bounds bounds = constraint.bounds(row);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < lanes; ++i) least = std::min({least, value[i] - bounds.lower, bounds.upper - value[i]});
  return least - constraint.activation_margin(row);
}

struct Configurations {
  explicit Configurations(unsigned seed)
      : random(seed),
        model(varied(seed, random)),
        ocp(model, {}),
        arm(model),
        one(model),
        clearance(seed % 3 == 0 ? kMostClearance : 0.0) {}

  static RobotModel varied(unsigned seed, std::mt19937& random) {
    RobotModel model = seed % 5 == 0 ? random_tree(random) : random_arm(1 + static_cast<int>(seed % 8), random);
    if (seed % 2 == 0) vary_bodies(model, random);
    return model;
  }

  /// Configurations around q.
  NodeBatch at(const JointVector& q, double around) {
    const int n = model.dof();
    JointVectorOf<Lanes> all(n);
    for (int lane = 0; lane < kLanes; ++lane) {
      const JointVector by = random_joints(n, around, random);
      for (int i = 0; i < n; ++i) all[i].set(lane, q[i] + by[i]);
    }
    arm.set_position(all);
    dq = u = JointVectorOf<Lanes>::Zero(n);
    return {{arm, dq, u, reference.data(), time, near, nullptr, nullptr, nullptr, clearance}, one};
  }

  std::mt19937 random;
  RobotModel model;
  Ocp ocp;
  KinematicsOf<Lanes> arm;
  Kinematics one;
  double clearance;
  JointVectorOf<Lanes> dq, u;
  std::array<ReferencePoseOf<Lanes>, kMaxTools> reference;
  Lanes time = 0.0;
  NearObstacles near;
};

/// No row within its margin is missed; in lanes that do not act none counts.
TEST(NearRows, AreFound) {
  int found = 0, rows = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Configurations f(seed);
    for (int trial = 0; trial < 20; ++trial) {
      const NodeBatch nodes = f.at(random_joints(f.model.dof(), 2.0, f.random), 0.1);
      const int lanes = 1 + trial % kLanes;
      Lanes acts = 0.0;
      for (int i = 0; i < lanes; ++i) acts.set(i, 1.0);
      for (const auto& constraint : f.ocp.constraints()) {
        std::vector<char> near(constraint->rows(), 0);
        constraint->find_near(nodes, acts, near.data());
        for (int row = 0; row < constraint->rows(); ++row) {
          const double beyond = beyond_margin(*constraint, nodes, row, lanes);
          if (std::abs(beyond) > 1e-12) {
            ASSERT_EQ(near[row] != 0, beyond < 0.0) << constraint->name() << " " << row;
          }
          found += near[row];
          ++rows;
        }
      }
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_LT(found, rows / 2);
}

/// Rows beyond their margins stay inside their bounds as far as the levers say, in every direction.
TEST(NearRows, OthersStayInsideAsFarAsTheLeversSay) {
  int tried = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Configurations f(seed);
    const int n = f.model.dof();
    for (const auto& constraint : f.ocp.constraints()) {
      const JointVector levers = constraint->levers();
      if (levers.size() == 0) continue;
      ASSERT_EQ(levers.size(), n);
      for (int trial = 0; trial < 50; ++trial) {
        const JointVector q = random_joints(n, 2.0, f.random);
        const NodeBatch before = f.at(q, 0.0);
        std::vector<bool> outside;
        for (int row = 0; row < constraint->rows(); ++row) {
          outside.push_back(beyond_margin(*constraint, before, row, 1) > 0.0);
        }
        JointVector step = random_joints(n, 1.0, f.random);
        const double used = levers.dot(step.cwiseAbs());
        if (used > 0.0) step /= used;
        const NodeBatch after = f.at(q + step, 0.0);
        for (int row = 0; row < constraint->rows(); ++row) {
          if (!outside[row]) continue;
          ++tried;
          ASSERT_GT(beyond_margin(*constraint, after, row, 1) + constraint->activation_margin(row), 0.0);
        }
      }
    }
  }
  EXPECT_GT(tried, 10000);
}

}  // namespace
}  // namespace steadyhand
