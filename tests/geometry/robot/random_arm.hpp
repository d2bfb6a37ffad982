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

/// A random serial arm with joints of both types, two spheres on every link and all pairs of links that are not
/// neighbours.
inline RobotModel random_arm(int dof, std::mt19937& random, bool prismatic = true) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto vector = [&] { return random_vector(random); };
  const auto frame = [&] {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = random_rotation(random);
    T.translation() = 0.4 * vector();
    return T;
  };
  RobotModel model;
  model.name = "random";
  for (int k = 0; k < dof; ++k) {
    const JointType type = prismatic && unit(random) < -0.5 ? JointType::kPrismatic : JointType::kRevolute;
    model.joints.push_back({"joint_" + std::to_string(k), type, frame(), vector().normalized()});
  }
  model.link_names.resize(dof + 1);
  model.tool = {"tool", frame()};
  model.home = JointVector::Zero(dof);
  model.position_min = JointVector::Constant(dof, -M_PI);
  model.position_max = JointVector::Constant(dof, M_PI);
  model.velocity_max = JointVector::Constant(dof, M_PI);
  model.acceleration_max = JointVector::Constant(dof, 15.0);
  for (int link = 0; link <= dof; ++link) {
    for (int i = 0; i < 2; ++i)
      model.bodies.push_back(Body::sphere("s" + std::to_string(2 * link + i), link, 0.2 * vector(), 0.05));
  }
  const int count = static_cast<int>(model.bodies.size());
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) {
      if (model.bodies[j].link - model.bodies[i].link > 1) model.pairs.emplace_back(i, j);
    }
  }
  return model;
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
