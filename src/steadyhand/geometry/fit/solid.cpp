#include "steadyhand/geometry/fit/solid.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "steadyhand/core/turn.hpp"

namespace steadyhand {

namespace {

constexpr double kSpare = 1e-4;   // m, by which solids hold more than they must
constexpr double kFinest = 2e-5;  // m, edges of pieces of triangles

double round_to(double value, double step) { return std::round(value / step) * step + 0.0; }
Vector3 round_to(const Vector3& v, double step) {
  return {round_to(v.x(), step), round_to(v.y(), step), round_to(v.z(), step)};
}

std::pair<Vector3, Vector3> ends_of(const FittedSolid& solid) {
  const Vector3 way = solid.shape.core.z() * solid.origin.linear().col(2);
  return {solid.origin.translation() - way, solid.origin.translation() + way};
}

Vector3 rpy_of(const Matrix3& R) {
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
          std::atan2(R(1, 0), R(0, 0))};
}

Matrix3 from_rpy(const Vector3& rpy) {
  return (Eigen::AngleAxisd(rpy[2], Vector3::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vector3::UnitY()) *
          Eigen::AngleAxisd(rpy[0], Vector3::UnitX()))
      .toRotationMatrix();
}

std::string list(const Vector3& v, int digits) {
  const auto number = [&](double x) {
    std::string text = fmt::format("{:.{}f}", x, digits);
    return text.find_first_not_of("-0.") == std::string::npos ? fmt::format("{:.{}f}", 0.0, digits) : text;
  };
  return fmt::format("[{}, {}, {}]", number(v.x()), number(v.y()), number(v.z()));
}

bool holds(const FittedSolid& solid, const Triangle& triangle, double spare) {
  return std::all_of(triangle.begin(), triangle.end(), [&](const Vector3& p) { return solid.distance(p) <= -spare; });
}

/// Pieces of triangles that no solid holds whole, each with its corners; cut down to `finest`.
template <typename Take>
bool each_open_piece(const Triangle& triangle, const std::vector<FittedSolid>& solids, double spare, const Take& take) {
  if (std::any_of(solids.begin(), solids.end(),
                  [&](const FittedSolid& solid) { return holds(solid, triangle, spare); })) {
    return true;
  }
  const auto& [a, b, c] = triangle;
  const double longest = std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
  const bool stands_out = std::any_of(triangle.begin(), triangle.end(), [&](const Vector3& p) {
    return std::all_of(solids.begin(), solids.end(), [&](const FittedSolid& s) { return s.distance(p) > -spare; });
  });
  if (longest < kFinest || (stands_out && longest < 1e-3)) return take(triangle);
  const Vector3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  for (const Triangle& piece : {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}}) {
    if (!each_open_piece(piece, solids, spare, take)) return false;
  }
  return true;
}

}  // namespace

double FittedSolid::distance(const Vector3& point) const {
  const Vector3 q = (origin.linear().transpose() * (point - origin.translation())).cwiseAbs() - shape.core;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - shape.radius;
}

FittedSolid rounded(const FittedSolid& solid) {
  FittedSolid result = solid;
  if (solid.shape.kind == ShapeKind::kCapsule) {
    auto [from, to] = ends_of(solid);
    from = round_to(from, FittedSolid::kStep);
    to = round_to(to, FittedSolid::kStep);
    result.origin.translation() = 0.5 * (from + to);
    result.shape.core.z() = 0.5 * (to - from).norm();
    result.origin.linear() = result.shape.core.z() > 1e-9 ? turn_between(Vector3::UnitZ(), to - from).toRotationMatrix()
                                                          : Matrix3(Matrix3::Identity());
    return result;
  }
  result.origin.translation() = round_to(Vector3(solid.origin.translation()), FittedSolid::kStep);
  if (solid.shape.kind == ShapeKind::kBox) {
    result.shape.core = round_to(solid.shape.core, FittedSolid::kStep).cwiseMax(FittedSolid::kLeastCore);
    result.origin.linear() = from_rpy(round_to(rpy_of(solid.origin.linear()), 1e-6));
  }
  return result;
}

std::string as_written(const FittedSolid& solid) {
  const double r = solid.shape.radius;
  switch (solid.shape.kind) {
    case ShapeKind::kCapsule: {
      const auto [from, to] = ends_of(solid);
      return fmt::format("capsule: {{from: {}, to: {}, radius: {:.5f}}}", list(from, 5), list(to, 5), r);
    }
    case ShapeKind::kBox:
      return fmt::format("box: {{size: {}, center: {}, rpy: {}, rounding: {:.5f}}}",
                         list(2.0 * (solid.shape.core + Vector3::Constant(r)), 5), list(solid.origin.translation(), 5),
                         list(rpy_of(solid.origin.linear()), 6), r);
    default:
      return fmt::format("sphere: {{center: {}, radius: {:.5f}}}", list(solid.origin.translation(), 5), r);
  }
}

void prove(const Surface& surface, std::vector<FittedSolid>& solids) {
  const auto grow = [&](FittedSolid& solid, double by) {
    solid.shape.radius = std::ceil((solid.shape.radius + by) / FittedSolid::kStep - 1e-6) * FittedSolid::kStep;
  };
  for (FittedSolid& solid : solids) grow(solid, 0.0);
  for (const Triangle& triangle : surface) {
    (void)each_open_piece(triangle, solids, kSpare, [&](const Triangle& piece) {
      FittedSolid* best = nullptr;
      double least = std::numeric_limits<double>::infinity();
      for (FittedSolid& solid : solids) {
        double need = -std::numeric_limits<double>::infinity();
        for (const Vector3& p : piece) need = std::max(need, solid.distance(p));
        if (need < least) {
          least = need;
          best = &solid;
        }
      }
      grow(*best, least + kSpare);
      return true;
    });
  }
}

bool is_covered(const Surface& surface, const std::vector<FittedSolid>& solids) {
  return std::all_of(surface.begin(), surface.end(), [&](const Triangle& triangle) {
    return each_open_piece(triangle, solids, 0.0, [](const Triangle&) { return false; });
  });
}

}  // namespace steadyhand
