#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Corners of a triangle, m.
using Triangle = std::array<Vector3, 3>;
/// The surface of something, in no order.
using Surface = std::vector<Triangle>;

/// Most triangles of one file.
inline constexpr std::size_t kMaxTriangles = 4'000'000;

/// A surface of one colour.
struct Painted {
  Vector3 color;  ///< red, green and blue, 0 to 1, as displays take them
  Surface surface;
};

/// Reads STL, OBJ, DAE and the other formats of Assimp. Applies node transforms and Collada's units, but not Collada's
/// up axis (as ROS does). Refuses, with the file's name and the reason: a file that cannot be read, that has no
/// triangles or more than kMaxTriangles, or that has a corner that is not finite or further away than 1 km.
Result<Surface> load_mesh(const std::filesystem::path& file);
/// The same with the colours of its materials; white where there are none.
Result<std::vector<Painted>> load_painted_mesh(const std::filesystem::path& file);

// Solids about their frame's origin, as URDFs have them, by flat triangles that lie on or outside of them.
Surface box_surface(const Vector3& size);                       ///< m, whole lengths
Surface cylinder_surface(double radius, double length);         ///< m, along z
Surface ball_surface(double radius);                            ///< m
Surface moved(Surface surface, const Eigen::Affine3d& motion);  ///< every corner, by the motion

}  // namespace steadyhand
