#include "steadyhand/files/config/shape_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "steadyhand/core/turn.hpp"

namespace steadyhand {

namespace {

constexpr double kTiny = 1e-9;  // m

ShapeEntry read_sphere(YamlMap sphere) {
  return {Shape::sphere(sphere.number("radius", Interval::positive())),
          Eigen::Isometry3d(Eigen::Translation3d(read_vector(sphere, "center", Vector3::Zero())))};
}

/// For a shape with two ends: its z along them, its origin half-way.
ShapeEntry between_ends(YamlMap& solid, double& half_length) {
  const Vector3 from = read_vector(solid, "from"), to = read_vector(solid, "to"), way = to - from;
  half_length = 0.5 * way.norm();
  ShapeEntry placed;
  placed.origin.translation() = 0.5 * (from + to);
  if (half_length > kTiny) placed.origin.linear() = turn_between(Vector3::UnitZ(), way).toRotationMatrix();
  return placed;
}

ShapeEntry read_capsule(YamlMap capsule) {
  double half = 0.0;
  ShapeEntry placed = between_ends(capsule, half);
  placed.shape = Shape::capsule(half, capsule.number("radius", Interval::positive()));
  return placed;
}

ShapeEntry read_cylinder(YamlMap cylinder) {
  double half = 0.0;
  ShapeEntry placed = between_ends(cylinder, half);
  if (half <= kTiny) cylinder.fail("to", "must be another point than 'from'");
  placed.shape = Shape::cylinder(cylinder.number("radius", Interval::positive()), std::max(half, kTiny));
  return placed;
}

ShapeEntry read_box(YamlMap box) {
  const std::vector<double> size = box.numbers("size", Interval::positive(), 3);
  const double rounding = box.number("rounding", Interval::not_negative(), 0.0);
  const Vector3 core = 0.5 * Vector3(size[0], size[1], size[2]) - Vector3::Constant(rounding);
  if (box.has("size") && core.minCoeff() <= 0.0) box.fail("rounding", "must be less than half of each size");
  return {Shape::box(core.cwiseMax(kTiny), rounding),
          Eigen::Translation3d(read_vector(box, "center", Vector3::Zero())) * read_rpy(box, "rpy")};
}

ShapeEntry read_half_space(YamlMap half_space) {
  const Vector3 point = read_vector(half_space, "point"), normal = read_vector(half_space, "normal", Vector3::UnitZ());
  ShapeEntry placed{Shape::half_space(), Eigen::Isometry3d(Eigen::Translation3d(point))};
  if (normal.norm() <= kTiny) {
    half_space.fail("normal", "must not be 0");
  } else {
    placed.origin.linear() = turn_between(Vector3::UnitZ(), normal).toRotationMatrix();
  }
  return placed;
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

ShapeEntry read_shape(YamlMap& solid, ShapesFor whose) {
  const struct {
    const char* kind;
    ShapeEntry (*read)(YamlMap);
  } kinds[] = {{"sphere", read_sphere},
               {"capsule", read_capsule},
               {"box", read_box},
               {"cylinder", read_cylinder},
               {"half_space", read_half_space}};
  const auto known = std::span(kinds).first(whose == ShapesFor::kWorld ? 5 : 4);
  const auto given = std::count_if(known.begin(), known.end(), [&](const auto& each) { return solid.has(each.kind); });
  for (const auto& [kind, read] : known) {
    if (given == 1 && solid.has(kind)) return read(solid.map(kind));
  }
  solid.fail(given == 0 ? "shape" : kinds[0].kind,
             fmt::format("must be one of sphere, capsule, box{}, with its sizes",
                         whose == ShapesFor::kWorld ? ", cylinder and half_space" : " and cylinder"));
  return {Shape::sphere(1.0)};
}

}  // namespace steadyhand
