#include "steadyhand/core/arrows.hpp"

#include <algorithm>

namespace steadyhand {

Plan& Plan::operator=(const Plan& other) {
  if (this == &other) return *this;
  stamp = other.stamp;
  start = other.start;
  dt = other.dt;
  joints = other.joints;
  intervals = other.intervals;
  world = other.world;
  origin = other.origin;
  velocity_max = other.velocity_max;
  std::copy_n(other.x.begin(), intervals + 1, x.begin());
  std::copy_n(other.u.begin(), intervals, u.begin());
  return *this;
}

}  // namespace steadyhand
