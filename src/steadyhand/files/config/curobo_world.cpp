#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "steadyhand/core/turn.hpp"
#include "steadyhand/files/config/cell_formats.hpp"
#include "steadyhand/files/config/shape_reader.hpp"

namespace steadyhand {

namespace {

constexpr std::array<const char*, 7> kKinds = {"cuboid", "sphere", "capsule", "cylinder", "mesh", "blox", "voxel"};

/// [x, y, z, qw, qx, qy, qz]
Eigen::Isometry3d read_pose(YamlMap& map) {
  const std::vector<double> n = map.numbers("pose", Interval::any(), 7);
  const Quaternion q(n[3], n[4], n[5], n[6]);
  if (std::abs(q.norm() - 1.0) > kQuaternionTolerance) {
    map.fail("pose",
             fmt::format("has a quaternion (its last four numbers, w first) of norm {:.6g}; it must be 1", q.norm()));
    return Eigen::Isometry3d::Identity();
  }
  return Eigen::Translation3d(n[0], n[1], n[2]) * q.normalized();
}

ShapeEntry read_kind(const std::string& kind, YamlMap& map) {
  const auto size = [&](const char* key) { return map.number(key, Interval::positive()); };
  if (kind == "cuboid") {
    const std::vector<double> dims = map.numbers("dims", Interval::positive(), 3);
    return {Shape::box(0.5 * Vector3(dims[0], dims[1], dims[2])), read_pose(map)};
  }
  if (kind == "cylinder") return {Shape::cylinder(size("radius"), 0.5 * size("height")), read_pose(map)};
  if (kind == "sphere") {
    const Shape sphere = Shape::sphere(size("radius"));
    if (!map.has("position")) return {sphere, read_pose(map)};
    return {sphere, Eigen::Isometry3d(Eigen::Translation3d(read_vector(map, "position")))};
  }
  const Vector3 base = read_vector(map, "base"), way = read_vector(map, "tip") - base;
  ShapeEntry capsule{Shape::capsule(0.5 * way.norm(), size("radius")), Eigen::Isometry3d::Identity()};
  if (map.has("pose")) capsule.origin = read_pose(map);
  capsule.origin = capsule.origin * Eigen::Translation3d(base + 0.5 * way);
  if (way.norm() > 0.0) capsule.origin = capsule.origin * turn_between(Vector3::UnitZ(), way);
  return capsule;
}

}  // namespace

bool is_curobo_world(YamlMap& map) {
  return std::any_of(kKinds.begin(), kKinds.end(), [&](const char* kind) { return map.has(kind); });
}

void read_curobo_world(YamlMap& map, Cell& cell) {
  for (const std::string kind : kKinds) {
    if (!map.has(kind)) continue;
    YamlMap named = map.map(kind);
    for (const std::string& name : named.keys()) {
      if (kind == "mesh" || kind == "blox" || kind == "voxel") {
        (void)named.has(name);  // known, so that the next line's error is reported
        map.fail(kind, fmt::format("has '{}', which is not read: give boxes, spheres, capsules or cylinders", name));
        return;
      }
      YamlMap solid = named.map(name);
      const ShapeEntry placed = read_kind(kind, solid);
      CellObject& object = cell.objects.emplace_back();
      object.name = name;
      object.shape = placed.shape;
      object.origin = placed.origin;
      if (solid.has("color")) object.color = hex_color(solid.numbers("color", {0.0, 1.0}, 4));
    }
  }
}

}  // namespace steadyhand
