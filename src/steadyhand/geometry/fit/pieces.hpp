#pragma once

#include <array>
#include <vector>

#include "steadyhand/geometry/fit/hull.hpp"
#include "steadyhand/geometry/mesh/mesh.hpp"

namespace steadyhand {

/// Small triangles by indices of corners, each corner once.
struct Pieces {
  Points corners;
  std::vector<std::array<int, 3>> triangles;
};

/// A surface thinned if there is much of it and cut into small triangles: some thousands, good for a search and not for
/// proofs.
Pieces small_triangles(const Surface& surface);

}  // namespace steadyhand
