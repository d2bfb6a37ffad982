#include "steadyhand/config/shape_reader.hpp"

#include <algorithm>

namespace steadyhand {

namespace {

constexpr double kTiny = 1e-9;  // m

PlacedShape read_sphere(YamlMap sphere) {
  return {Shape::sphere(sphere.number("radius", Interval::positive())),
          Eigen::Isometry3d(Eigen::Translation3d(read_vector(sphere, "center", Vector3::Zero())))};
}

/// Of what has two ends: the shape's z along them, its origin half-way.
PlacedShape between_ends(YamlMap& solid, double& half_length) {
  const Vector3 from = read_vector(solid, "from"), to = read_vector(solid, "to"), way = to - from;
  half_length = 0.5 * way.norm();
  PlacedShape placed;
  placed.origin.translation() = 0.5 * (from + to);
  if (half_length > kTiny)
    placed.origin.linear() = Quaternion::FromTwoVectors(Vector3::UnitZ(), way).toRotationMatrix();
  return placed;
}

PlacedShape read_capsule(YamlMap capsule) {
  double half = 0.0;
  PlacedShape placed = between_ends(capsule, half);
  placed.shape = Shape::capsule(half, capsule.number("radius", Interval::positive()));
  return placed;
}

PlacedShape read_cylinder(YamlMap cylinder) {
  double half = 0.0;
  PlacedShape placed = between_ends(cylinder, half);
  if (half <= kTiny) cylinder.fail("to", "must be another point than 'from'");
  placed.shape = Shape::cylinder(cylinder.number("radius", Interval::positive()), std::max(half, kTiny));
  return placed;
}

PlacedShape read_box(YamlMap box) {
  const std::vector<double> size = box.numbers("size", Interval::positive(), 3);
  const double rounding = box.number("rounding", Interval::not_negative(), 0.0);
  const Vector3 core = 0.5 * Vector3(size[0], size[1], size[2]) - Vector3::Constant(rounding);
  if (core.minCoeff() <= 0.0) box.fail("rounding", "must be less than half of each size");
  return {Shape::box(core.cwiseMax(kTiny), rounding),
          Eigen::Translation3d(read_vector(box, "center", Vector3::Zero())) * read_rpy(box, "rpy")};
}

}  // namespace

Vector3 read_vector(YamlMap& map, const std::string& key, std::optional<Vector3> fallback) {
  if (fallback && !map.has(key)) return *fallback;
  const std::vector<double> numbers = map.numbers(key, Interval::any(), 3);
  return {numbers[0], numbers[1], numbers[2]};
}

Quaternion read_rpy(YamlMap& map, const std::string& key) {
  const Vector3 rpy = read_vector(map, key, Vector3::Zero());
  return Eigen::AngleAxisd(rpy[2], Vector3::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vector3::UnitY()) *
         Eigen::AngleAxisd(rpy[0], Vector3::UnitX());
}

PlacedShape read_shape(YamlMap& solid) {
  constexpr const char* kKinds[] = {"sphere", "capsule", "box", "cylinder"};
  const auto given = std::count_if(std::begin(kKinds), std::end(kKinds), [&](auto kind) { return solid.has(kind); });
  if (given == 1) {
    if (solid.has("sphere")) return read_sphere(solid.map("sphere"));
    if (solid.has("capsule")) return read_capsule(solid.map("capsule"));
    if (solid.has("box")) return read_box(solid.map("box"));
    return read_cylinder(solid.map("cylinder"));
  }
  solid.fail(given == 0 ? "shape" : kKinds[0], "must be one of sphere, capsule, box and cylinder, with its sizes");
  return {Shape::sphere(1.0)};
}

}  // namespace steadyhand
