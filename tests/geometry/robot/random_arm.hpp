#pragma once

#include <random>

#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// A separate statement for each number: the compiler chooses the order in which a call's arguments are evaluated.
inline Vector3 random_vector(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double z = unit(random), y = unit(random), x = unit(random);
  return {x, y, z};
}

inline Matrix3 random_rotation(std::mt19937& random) {
  const Vector3 axis = random_vector(random).normalized();
  const double angle = M_PI * std::uniform_real_distribution<double>(-1.0, 1.0)(random);
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

inline Eigen::Isometry3d random_frame(std::mt19937& random) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = random_rotation(random);
  T.translation() = 0.4 * random_vector(random);
  return T;
}

/// All pairs of bodies with two joints or more between their links.
inline std::vector<BodyPair> all_pairs(const RobotModel& model) {
  std::vector<BodyPair> pairs;
  const int count = static_cast<int>(model.bodies.size());
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) {
      if (way_between(model, model.bodies[i].link, model.bodies[j].link).size() > 1) pairs.emplace_back(i, j);
    }
  }
  return pairs;
}

/// A random serial arm with joints of both types, two spheres on every link, and all_pairs.
inline RobotModel random_arm(int dof, std::mt19937& random, bool prismatic = true) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto vector = [&] { return random_vector(random); };
  const auto frame = [&] { return random_frame(random); };
  RobotModel model;
  model.name = "random";
  for (int k = 0; k < dof; ++k) {
    const JointType type = prismatic && unit(random) < -0.5 ? JointType::kPrismatic : JointType::kRevolute;
    model.joints.push_back({"joint_" + std::to_string(k), type, frame(), vector().normalized()});
  }
  model.link_names.resize(dof + 1);
  model.tools = {{"tool", frame(), dof}};
  model.home = JointVector::Zero(dof);
  model.position_min = JointVector::Constant(dof, -M_PI);
  model.position_max = JointVector::Constant(dof, M_PI);
  model.velocity_max = JointVector::Constant(dof, M_PI);
  model.acceleration_max = JointVector::Constant(dof, 15.0);
  for (int link = 0; link <= dof; ++link) {
    for (int i = 0; i < 2; ++i)
      model.bodies.push_back(Body::sphere("s" + std::to_string(2 * link + i), link, 0.2 * vector(), 0.05));
  }
  model.pairs = all_pairs(model);
  return model;
}

/// Two random arms, as random_arm: `shared` joints move both, behind them each arm has its own.
inline RobotModel random_tree(int shared, int left, int right, std::mt19937& random, bool prismatic = true) {
  const int dof = shared + left + right;
  RobotModel model = random_arm(dof, random, prismatic);
  model.joints[shared + left].parent = shared;
  model.tools = {{"left", random_frame(random), shared + left}, {"right", random_frame(random), dof}};
  model.pairs = all_pairs(model);
  return model;
}

/// One of 0 to 2 shared joints, and 2 to 5 of each arm.
inline RobotModel random_tree(std::mt19937& random, bool prismatic = true) {
  const auto below = [&](unsigned end) { return static_cast<int>(random() % end); };
  const int shared = below(3), left = 2 + below(4), right = 2 + below(4);
  return random_tree(shared, left, right, random, prismatic);
}

inline JointVector random_joints(int dof, double bound, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-bound, bound);
  return JointVector::NullaryExpr(dof, [&](Eigen::Index) { return uniform(random); });
}

/// Makes its bodies capsules, boxes, cylinders and spheres, in turn, lying anyhow.
inline void vary_bodies(RobotModel& model, std::mt19937& random) {
  const Shape shapes[] = {Shape::capsule(0.1, 0.04), Shape::box({0.05, 0.08, 0.03}, 0.01), Shape::cylinder(0.04, 0.08),
                          Shape::sphere(0.05)};
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    model.bodies[i].shape = shapes[i % std::size(shapes)];
    model.bodies[i].origin.linear() = random_rotation(random);
  }
}

}  // namespace steadyhand
