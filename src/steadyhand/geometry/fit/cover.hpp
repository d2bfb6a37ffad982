#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "steadyhand/geometry/fit/solid.hpp"
#include "steadyhand/geometry/mesh/mesh.hpp"

namespace steadyhand {

/// A place where the room that a cover takes has a cost. `point` (m, link's frame) is `gap` (m) outside of the geometry
/// to cover; a cover that takes t (m) of that costs share * min(1, t / limit)^n + slope * t, n as in CoverSettings.
struct CoverProbe {
  Vector3 point;
  double gap = 0.0;
  double share = 0.0, limit = 1.0;  ///< limit: m
  double slope = 0.0;               ///< 1/m
};

struct CoverSettings {
  int most = 4;            ///< bodies
  bool boxes = true;       ///< besides spheres and capsules
  double price = 0.0;      ///< for each body, in the unit of the cost
  double box_price = 0.0;  ///< extra for a box
  int squarings = 0;       ///< n = 3 * 2^squarings: a larger n gives less weight to near contacts
  std::uint32_t seed = 1;
  std::function<void(double)> progress;  ///< 0 to 1
};

struct Cover {
  std::vector<FittedSolid>
      solids;         ///< with numbers as they are written (as_written), so that reading them changes nothing
  double cost = 0.0;  ///< room taken from the probes
};

/// Few solids of which one holds each triangle, or each of the pieces into which the triangle is cut: proven for the
/// numbers that are written.
/// @param last solids to start from, in addition to others; may be empty
Cover cover(const Surface& surface, const std::vector<CoverProbe>& probes, const CoverSettings& settings,
            const std::vector<FittedSolid>& last = {});

}  // namespace steadyhand
