#pragma once

#include <cmath>

#include "steadyhand/arms/ur/ur_primary.hpp"

namespace steadyhand {

/// Denavit and Hartenberg's parameters of a UR5e as the manufacturer publishes them.
inline UrKinematics ur5e_kinematics() {
  UrKinematics k;
  k.a = {0.0, -0.425, -0.3922, 0.0, 0.0, 0.0};
  k.d = {0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996};
  k.alpha = {M_PI / 2.0, 0.0, 0.0, M_PI / 2.0, -M_PI / 2.0, 0.0};
  return k;
}

}  // namespace steadyhand
