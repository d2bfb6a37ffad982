#include "steadyhand/core/arrows.hpp"

#include <algorithm>

namespace steadyhand {

Reference& Reference::operator=(const Reference& other) {
  if (this == &other) return *this;
  stamp = other.stamp;
  start = other.start;
  dt = other.dt;
  nodes = other.nodes;
  const int used = std::clamp(nodes, 0, kMaxHorizon);
  for (std::size_t t = 0; t < tools.size(); ++t) {
    std::copy_n(other.tools[t].p.begin(), used, tools[t].p.begin());
    std::copy_n(other.tools[t].R.begin(), used, tools[t].R.begin());
    std::copy_n(other.tools[t].spread.begin(), used, tools[t].spread.begin());
  }
  return *this;
}

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
