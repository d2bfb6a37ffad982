#pragma once

#include "steadyhand/files/config/yaml_reader.hpp"
#include "steadyhand/geometry/collision/shape.hpp"

namespace steadyhand {

/// A shape and its pose, in the frame of its file.
struct ShapeEntry {
  Shape shape;
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< pose of the shape's frame
};

/// Three numbers of a key, m.
Vector3 read_vector(YamlMap& map, const std::string& key, std::optional<Vector3> fallback = {});
/// Roll, pitch and yaw of a key, rad, about fixed axes as in a URDF; none if it is absent.
Quaternion read_rpy(YamlMap& map, const std::string& key);

/// Whose shapes are read: half-spaces are only in the world.
enum class ShapesFor { kArm, kWorld };

/// The one key of `solid` that names a shape, with what it holds: docs/how-to/add-a-robot.md, "Bodies". The mapping's
/// finish() reports errors; the shape is then a harmless one.
ShapeEntry read_shape(YamlMap& solid, ShapesFor whose);

}  // namespace steadyhand
