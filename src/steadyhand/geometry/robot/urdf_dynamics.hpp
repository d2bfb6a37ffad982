#pragma once

#include <filesystem>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"

namespace steadyhand {

/// Inertia of a rigid body.
struct Inertia {
  double mass = 0.0;                 ///< kg
  Vector3 center = Vector3::Zero();  ///< m, of mass, in the body's frame
  Matrix3 about = Matrix3::Zero();   ///< kg m^2, about the centre of mass, in the body's axes
};

/// Inertia of two bodies that are fixed to each other.
Inertia operator+(const Inertia& one, const Inertia& other);

/// The data that the dynamics of a chain need in addition to its kinematics.
struct ChainDynamics {
  std::vector<Inertia>
      links;               ///< n + 1, first the base's, in the frames of the links; each with the bodies fixed to it
  JointVector effort_max;  ///< n, Nm (N)
};

/// Reads masses and largest efforts of a chain from its URDF. Refuses, with the reason: a moving link without mass, an
/// inertia that no body can have, and a joint without a largest effort.
Result<ChainDynamics> read_chain_dynamics(const std::filesystem::path& file, const UrdfChain& chain,
                                          Xacro xacro = Xacro::kIfNamed);

}  // namespace steadyhand
