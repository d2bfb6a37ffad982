#pragma once

#include <random>
#include <vector>

#include "steadyhand/geometry/mesh/mesh.hpp"

namespace steadyhand {

/// From 0 to 1: the same in every standard library.
inline double uniform(std::mt19937& random) { return random() / 4294967296.0; }

using Points = std::vector<Vector3>;  ///< m

/// A convex polyhedron. Points nearer than a ten-thousandth of the extent are merged, and faces are those of
/// points moved by a millionth, so that none is degenerate: good for measures, not for proofs.
struct Hull {
  Points corners;       ///< m
  Surface faces;        ///< seen from outside, corners turn left
  double volume = 0.0;  ///< m^3
};

/// Directions over the whole sphere, evenly, unit.
Points even_directions(int count);
/// Those of the points that are furthest in one of the directions.
Points extreme_points(const Points& points, const Points& directions);
/// Of as many as 1500 points exactly, of more by their extremes. Empty faces if the points are all one.
Hull convex_hull(const Points& points);

/// Convex parts that hold the surface, at most `most`: it is cut by planes where that takes most volume away, until no
/// cut takes `least` (share of the whole) away.
std::vector<Hull> convex_parts(const std::vector<Surface>& pieces, int most, double least);

/// Nearest points of two convex hulls of points.
struct Nearest {
  double distance = 0.0;  ///< m; 0 where they overlap
  Vector3 first = Vector3::Zero(), second = Vector3::Zero();
};
/// @param motion places the second's points in the frame of the first
/// @param enough m: stops as soon as they are shown to be further apart, and returns a distance above that
Nearest nearest_points(const Points& first, const Points& second, const Eigen::Isometry3d& motion, double enough);

}  // namespace steadyhand
