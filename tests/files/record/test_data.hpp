#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "steadyhand/files/record/step.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand::test {

inline std::filesystem::path temporary_file(const std::string& name) {
  static const TemporaryFolder folder;
  return folder.path() / name;
}

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline RunNames names() { return {{"lift", "elbow", "wrist"}, {"m", "rad", "rad"}, {"position", "lateral"}}; }

/// Every field set, all of them different.
inline PlanStep random_step(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&](int n) {
    JointVector v(n);
    for (double& x : v) x = uniform(random);
    return v;
  };
  const auto pose = [&] {
    return Pose{vector(3), Quaternion(uniform(random), uniform(random), uniform(random), uniform(random)).normalized()};
  };
  PlanStep step;
  step.t_s = 1 + uniform(random);
  step.tools[0].X_base_target = pose();
  step.tools[0].X_base_planned = pose();
  step.q = vector(3);
  step.dq = vector(3);
  step.ddq = vector(3);
  step.tools[0].local_acceleration = vector(3);
  step.shares = {uniform(random), uniform(random)};
  step.objective = step.shares[0] + step.shares[1];
  step.iterations = static_cast<int>(random() % 30);
  step.solve_time_us = 1000 + 500 * uniform(random);
  step.status = static_cast<PlanOrigin>(random() % 3);
  step.smallest_sphere_distance_m = uniform(random);
  step.tools[0].engaged = random() % 2;
  return step;
}

}  // namespace steadyhand::test
