#include "steadyhand/geometry/fit/pieces.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace steadyhand {

namespace {

void cut_line(const Vector3& from, const Vector3& to, double edge, Surface& pieces) {
  const int count = static_cast<int>(std::ceil((to - from).norm() / edge));
  const auto at = [&](int i) -> Vector3 { return from + (to - from) * i / count; };
  for (int i = 0; i < count; ++i) pieces.push_back({at(i), at(i + 1), at(i + 1)});
}

/// Triangles cut into pieces with edges of at most `edge`. A triangle of almost no height becomes its longest edge:
/// halved like the others, it would have 3 pieces with every halving of their length, so soon more than memory holds.
/// Stops at `most` pieces.
void cut_small(const Triangle& triangle, double edge, std::size_t most, Surface& pieces) {
  if (pieces.size() >= most) return;
  constexpr double kFlat = 1e-3;  // of `edge`
  const auto& [a, b, c] = triangle;
  const double ab = (a - b).norm(), bc = (b - c).norm(), ca = (c - a).norm();
  const double longest = std::max({ab, bc, ca});
  if (longest <= edge) {
    pieces.push_back(triangle);
  } else if ((b - a).cross(c - a).norm() <= kFlat * edge * longest) {
    cut_line(longest == bc ? b : a, longest == ab ? b : c, edge, pieces);
  } else if (longest == ab) {
    const Vector3 middle = 0.5 * (a + b);
    cut_small({a, middle, c}, edge, most, pieces);
    cut_small({middle, b, c}, edge, most, pieces);
  } else if (longest == bc) {
    const Vector3 middle = 0.5 * (b + c);
    cut_small({a, b, middle}, edge, most, pieces);
    cut_small({a, middle, c}, edge, most, pieces);
  } else {
    const Vector3 middle = 0.5 * (c + a);
    cut_small({a, b, middle}, edge, most, pieces);
    cut_small({middle, b, c}, edge, most, pieces);
  }
}

/// @param grid m: corners within one cell become one
Pieces joined(const Surface& surface, double grid) {
  Pieces mesh;
  std::map<std::array<long, 3>, int> cells;
  std::map<std::array<int, 3>, int> seen;
  for (const Triangle& triangle : surface) {
    std::array<int, 3> indices;
    for (int i = 0; i < 3; ++i) {
      const Vector3 cell = (triangle[i] / grid).array().round();
      const std::array<long, 3> key{std::lround(cell.x()), std::lround(cell.y()), std::lround(cell.z())};
      const auto [place, fresh] = cells.emplace(key, static_cast<int>(mesh.corners.size()));
      if (fresh) mesh.corners.push_back(triangle[i]);
      indices[i] = place->second;
    }
    std::sort(indices.begin(), indices.end());
    if (seen.emplace(indices, 0).second) mesh.triangles.push_back(indices);
  }
  return mesh;
}

/// All triangles cut, to at least such an edge (m) that few pieces result: needles and lines have no area, but length,
/// and slivers have neither but many pieces.
Pieces cut(const Surface& surface, double edge) {
  double length = 0.0;
  for (const auto& [a, b, c] : surface) length += std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
  constexpr std::size_t kMost = 100'000;
  Surface pieces;
  for (edge = std::max(edge, length / 20000.0);; edge *= 2.0) {
    pieces.clear();
    for (const Triangle& triangle : surface) cut_small(triangle, edge, kMost, pieces);
    if (pieces.size() < kMost || edge > length) break;
  }
  return joined(pieces, 1e-7);
}

}  // namespace

Pieces small_triangles(const Surface& surface) {
  constexpr std::size_t kEnough = 7000;
  double area = 0.0;
  for (const auto& [a, b, c] : surface) area += 0.5 * (b - a).cross(c - a).norm();
  const double edge = std::max(2.5 * std::sqrt(area / 3000.0), 1e-4);
  if (surface.size() <= kEnough) return cut(surface, edge);
  // First thinned, so that cutting begins with few.
  const Pieces thin = joined(surface, 0.3 * edge);
  Surface rest;
  for (const auto& [a, b, c] : thin.triangles) rest.push_back({thin.corners[a], thin.corners[b], thin.corners[c]});
  return cut(rest, edge);
}

}  // namespace steadyhand
