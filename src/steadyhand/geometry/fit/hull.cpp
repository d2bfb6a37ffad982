#include "steadyhand/geometry/fit/hull.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

namespace steadyhand {

namespace {

constexpr std::size_t kExactPoints = 1500;

/// Slivers are many, and whether a point is above one is a matter of few digits.
using Exact = Eigen::Matrix<long double, 3, 1>;

struct Face {
  std::array<int, 3> corner;
  Exact normal;
  long double offset;
};

Face make_face(const Points& points, int a, int b, int c) {
  const Exact p = points[a].cast<long double>();
  const Exact normal = (points[b].cast<long double>() - p).cross(points[c].cast<long double>() - p);
  return {{a, b, c}, normal, normal.dot(p)};
}

bool sees(const Vector3& point, const Face& face) { return face.normal.dot(point.cast<long double>()) > face.offset; }

/// Adds point after point: faces that see it go, their horizon is joined with it.
std::vector<Face> hull_faces(const Points& points) {
  const int count = static_cast<int>(points.size());
  const auto furthest = [&](const auto& measure) {
    int best = 0;
    double most = -1.0;
    for (int i = 0; i < count; ++i) {
      if (const double value = measure(points[i]); value > most) {
        most = value;
        best = i;
      }
    }
    return best;
  };
  const int a = furthest([&](const Vector3& p) { return (p - points[0]).squaredNorm(); });
  const int b = furthest([&](const Vector3& p) { return (p - points[a]).squaredNorm(); });
  const Vector3 line = (points[b] - points[a]).normalized();
  const int c = furthest([&](const Vector3& p) { return (p - points[a]).cross(line).squaredNorm(); });
  const Vector3 normal = line.cross(points[c] - points[a]).normalized();
  const int d = furthest([&](const Vector3& p) { return std::abs((p - points[a]).dot(normal)); });
  if (a == b || !normal.allFinite() || !(std::abs((points[d] - points[a]).dot(normal)) > 0.0)) return {};
  std::vector<Face> faces;
  const Vector3 inside = 0.25 * (points[a] + points[b] + points[c] + points[d]);
  for (const auto& [i, j, k] : {std::array{a, b, c}, std::array{a, b, d}, std::array{a, c, d}, std::array{b, c, d}}) {
    Face face = make_face(points, i, j, k);
    if (sees(inside, face)) face = make_face(points, i, k, j);
    faces.push_back(face);
  }
  std::vector<Face> kept;
  std::set<std::pair<int, int>> edges;
  for (int i = 0; i < count; ++i) {
    if (i == a || i == b || i == c || i == d) continue;
    kept.clear();
    edges.clear();
    for (const Face& face : faces) {
      if (!sees(points[i], face)) {
        kept.push_back(face);
        continue;
      }
      for (int e = 0; e < 3; ++e) {
        const std::pair edge{face.corner[e], face.corner[(e + 1) % 3]};
        if (edges.erase({edge.second, edge.first}) == 0) edges.insert(edge);
      }
    }
    if (edges.empty()) continue;
    for (const auto& [from, to] : edges) kept.push_back(make_face(points, from, to, i));
    faces.swap(kept);
  }
  return faces;
}

void cut(const Surface& surface, const Vector3& normal, double offset, Surface& below, Surface& above) {
  for (const Triangle& triangle : surface) {
    std::array<double, 3> height;
    for (int i = 0; i < 3; ++i) height[i] = normal.dot(triangle[i]) - offset;
    if (*std::max_element(height.begin(), height.end()) <= 0.0) {
      below.push_back(triangle);
    } else if (*std::min_element(height.begin(), height.end()) >= 0.0) {
      above.push_back(triangle);
    } else {
      for (const double side : {-1.0, 1.0}) {
        Points outline;
        for (int i = 0; i < 3; ++i) {
          const int j = (i + 1) % 3;
          if (side * height[i] >= 0.0) outline.push_back(triangle[i]);
          if ((height[i] < 0.0) != (height[j] < 0.0)) {
            const double share = std::clamp(height[i] / (height[i] - height[j]), 0.0, 1.0);
            outline.push_back(triangle[i] + share * (triangle[j] - triangle[i]));
          }
        }
        Surface& target = side < 0.0 ? below : above;
        for (std::size_t i = 2; i < outline.size(); ++i) target.push_back({outline[0], outline[i - 1], outline[i]});
      }
    }
  }
}

/// Each once: files such as STL repeat a corner with every triangle at it.
Points corners_of(const Surface& surface) {
  Points points;
  points.reserve(3 * surface.size());
  for (const Triangle& triangle : surface) points.insert(points.end(), triangle.begin(), triangle.end());
  const auto before = [](const Vector3& a, const Vector3& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::sort(points.begin(), points.end(), before);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

struct Cut {
  double gain = 0.0;  // m^3
  Surface below, above;
};

/// Not more than `most` of the triangles, evenly.
Surface some_of(const Surface& surface, std::size_t most) {
  if (surface.size() <= most) return surface;
  Surface some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(surface[i * surface.size() / most]);
  return some;
}

/// The best cut of a surface into two, by planes across its principal axes and the frame's. Of fine surfaces the plane
/// is found by some of the triangles.
Cut best_cut(const Surface& whole_surface, const Points& directions) {
  constexpr int kSlices = 12;
  constexpr std::size_t kLookedAt = 1500;
  const Surface surface = some_of(whole_surface, kLookedAt);
  const Points points = extreme_points(corners_of(surface), directions);
  const double whole = convex_hull(points).volume;
  Vector3 mean = Vector3::Zero();
  for (const Vector3& p : points) mean += p / static_cast<double>(points.size());
  Matrix3 spread = Matrix3::Zero();
  for (const Vector3& p : points) spread += (p - mean) * (p - mean).transpose();
  const Matrix3 axes = Eigen::SelfAdjointEigenSolver<Matrix3>(spread).eigenvectors();
  Cut best;
  Vector3 best_normal = Vector3::Zero();
  double best_height = 0.0;
  for (int axis = 0; axis < 6; ++axis) {
    const Vector3 normal = axis < 3 ? Vector3::Unit(axis) : Vector3(axes.col(axis - 3));
    if (axis >= 3 && normal.cwiseAbs().maxCoeff() > 0.999) continue;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vector3& p : points) {
      low = std::min(low, normal.dot(p));
      high = std::max(high, normal.dot(p));
    }
    for (int slice = 1; slice < kSlices; ++slice) {
      Cut candidate;
      const double height = low + (high - low) * slice / kSlices;
      cut(surface, normal, height, candidate.below, candidate.above);
      if (candidate.below.empty() || candidate.above.empty()) continue;
      candidate.gain = whole;
      for (const Surface* side : {&candidate.below, &candidate.above}) {
        candidate.gain -= convex_hull(extreme_points(corners_of(*side), directions)).volume;
      }
      if (candidate.gain <= best.gain) continue;
      best = std::move(candidate);
      best_normal = normal;
      best_height = height;
    }
  }
  if (best.gain > 0.0 && surface.size() < whole_surface.size()) {
    best.below.clear();
    best.above.clear();
    cut(whole_surface, best_normal, best_height, best.below, best.above);
  }
  return best;
}

}  // namespace

Points even_directions(int count) {
  Points directions(count);
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count, angle = i * M_PI * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    directions[i] = {r * std::cos(angle), r * std::sin(angle), z};
  }
  return directions;
}

Points extreme_points(const Points& points, const Points& directions) {
  if (points.size() <= directions.size()) return points;
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::ArrayXf x(count), y(count), z(count), heights(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    x[i] = static_cast<float>(points[i].x());
    y[i] = static_cast<float>(points[i].y());
    z[i] = static_cast<float>(points[i].z());
  }
  std::vector<Eigen::Index> chosen;
  for (const Vector3& direction : directions) {
    const Eigen::Vector3f d = direction.cast<float>();
    heights = d.x() * x + d.y() * y + d.z() * z;
    const float most = heights.maxCoeff();  // where it is costs more than that it is
    Eigen::Index index = 0;
    while (heights[index] != most) ++index;
    chosen.push_back(index);
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  Points extremes;
  for (const Eigen::Index index : chosen) extremes.push_back(points[index]);
  return extremes;
}

Hull convex_hull(const Points& points) {
  if (points.empty()) return {};
  if (points.size() > kExactPoints) return convex_hull(extreme_points(points, even_directions(kExactPoints)));
  double extent = 0.0;
  for (const Vector3& p : points) extent = std::max(extent, (p - points[0]).cwiseAbs().maxCoeff());
  // Keep one of several nearly equal points: faces between them would be only rounding errors.
  std::set<std::array<long, 3>> seen;
  Points single;
  for (const Vector3& p : points) {
    const double cell = 1e-4 * extent + 1e-12;
    if (seen.insert({std::lround(p.x() / cell), std::lround(p.y() / cell), std::lround(p.z() / cell)}).second) {
      single.push_back(p);
    }
  }
  std::mt19937 random(1);
  Points joggled = single;
  for (Vector3& p : joggled) {
    for (int i = 0; i < 3; ++i) p[i] += 1e-6 * extent * (random() / 2147483648.0 - 1.0);
  }
  Hull hull;
  std::map<int, int> used;
  const Vector3 origin = joggled[0];
  for (const Face& face : hull_faces(joggled)) {
    Triangle triangle;
    for (int i = 0; i < 3; ++i) {
      triangle[i] = joggled[face.corner[i]];
      if (used.emplace(face.corner[i], 0).second) hull.corners.push_back(single[face.corner[i]]);
    }
    hull.volume += (triangle[0] - origin).dot((triangle[1] - origin).cross(triangle[2] - origin)) / 6.0;
    hull.faces.push_back(triangle);
  }
  if (hull.corners.empty()) hull.corners = {points[0]};
  return hull;
}

std::vector<Hull> convex_parts(const std::vector<Surface>& pieces, int most, double least) {
  struct Piece {
    Surface surface;
    Cut cut;
  };
  const Points directions = even_directions(200);
  std::vector<Piece> parts;
  double whole = 0.0;
  const bool cuts = static_cast<int>(pieces.size()) < most;
  for (const Surface& piece : pieces) {
    parts.push_back({piece, cuts ? best_cut(piece, directions) : Cut()});
    whole += convex_hull(corners_of(piece)).volume;
  }
  while (static_cast<int>(parts.size()) < most) {
    const auto best = std::max_element(parts.begin(), parts.end(),
                                       [](const Piece& a, const Piece& b) { return a.cut.gain < b.cut.gain; });
    if (best == parts.end() || !(best->cut.gain > least * whole)) break;
    Cut chosen = std::move(best->cut);
    *best = {chosen.below, best_cut(chosen.below, directions)};
    parts.push_back({chosen.above, best_cut(chosen.above, directions)});
  }
  std::vector<Hull> hulls;
  for (const Piece& part : parts) hulls.push_back(convex_hull(corners_of(part.surface)));
  return hulls;
}

namespace {

/// A corner of the Minkowski difference and the points that it is made of.
struct Corner {
  Vector3 point, first, second;
};

struct Simplex {
  std::array<Corner, 4> corner;
  std::array<double, 4> weight{};  // barycentric, of the simplex point nearest to the origin
  int size = 0;
};

Vector3 nearest_of(const Simplex& simplex) {
  Vector3 point = Vector3::Zero();
  for (int i = 0; i < simplex.size; ++i) point += simplex.weight[i] * simplex.corner[i].point;
  return point;
}

/// The subset of corners whose affine hull is nearest to the origin inside of it: of all subsets the nearest one with
/// weights that are all positive.
void reduce(Simplex& simplex) {
  Simplex best;
  double least = std::numeric_limits<double>::infinity();
  for (int mask = 1; mask < 1 << simplex.size; ++mask) {
    Simplex subset;
    for (int i = 0; i < simplex.size; ++i) {
      if (mask & (1 << i)) subset.corner[subset.size++] = simplex.corner[i];
    }
    if (subset.size > 1) {
      // Weights w of corners 1.. with respect to corner 0: minimise |p0 + E w|.
      Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> edges(3, subset.size - 1);
      for (int i = 1; i < subset.size; ++i) edges.col(i - 1) = subset.corner[i].point - subset.corner[0].point;
      const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3> square = edges.transpose() * edges;
      Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> right = -edges.transpose() * subset.corner[0].point, w;
      if (subset.size == 2) {
        if (!(square(0, 0) > 0.0)) continue;
        w = right / square(0, 0);
      } else if (subset.size == 3) {
        const double det = square(0, 0) * square(1, 1) - square(0, 1) * square(1, 0);
        if (!(det > 1e-14 * square(0, 0) * square(1, 1))) continue;
        w.resize(2);
        w[0] = (right[0] * square(1, 1) - right[1] * square(0, 1)) / det;
        w[1] = (right[1] * square(0, 0) - right[0] * square(1, 0)) / det;
      } else {
        const Matrix3 E = edges;
        const double det = E.determinant();
        if (!(std::abs(det) > 1e-10 * E.col(0).norm() * E.col(1).norm() * E.col(2).norm())) continue;
        w = -E.inverse() * subset.corner[0].point;
      }
      subset.weight[0] = 1.0 - w.sum();
      for (int i = 1; i < subset.size; ++i) subset.weight[i] = w[i - 1];
      if (*std::min_element(subset.weight.begin(), subset.weight.begin() + subset.size) < 0.0) continue;
    } else {
      subset.weight[0] = 1.0;
    }
    const double distance = subset.size == 4 ? 0.0 : nearest_of(subset).squaredNorm();
    if (distance < least) {
      least = distance;
      best = subset;
    }
  }
  simplex = best;
}

Vector3 furthest(const Points& points, const Vector3& direction) {
  double most = -std::numeric_limits<double>::infinity();
  const Vector3* best = &points[0];
  for (const Vector3& p : points) {
    if (const double height = p.dot(direction); height > most) {
      most = height;
      best = &p;
    }
  }
  return *best;
}

}  // namespace

Nearest nearest_points(const Points& first, const Points& second, const Eigen::Isometry3d& motion, double enough) {
  const Matrix3 R = motion.linear();
  const auto corner = [&](const Vector3& direction) {
    Corner c;
    c.first = furthest(first, direction);
    c.second = motion * furthest(second, R.transpose() * -direction);
    c.point = c.first - c.second;
    return c;
  };
  Simplex simplex;
  simplex.corner[0] = corner(motion.translation());
  simplex.size = 1;
  simplex.weight[0] = 1.0;
  Nearest result;
  for (int round = 0; round < 64; ++round) {
    const Vector3 v = nearest_of(simplex);
    const double length = v.norm();
    if (simplex.size == 4 || length < 1e-9) break;
    const Corner next = corner(-v);
    const double bound = next.point.dot(v) / length;  // the origin is at least so far
    if (bound > enough) return {bound, Vector3::Zero(), Vector3::Zero()};
    if (length - bound < 1e-7) {
      result.distance = length;
      break;
    }
    simplex.corner[simplex.size++] = next;
    reduce(simplex);
    result.distance = nearest_of(simplex).norm();
    if (result.distance >= length) break;  // rounding
  }
  if (simplex.size == 4) result.distance = 0.0;
  for (int i = 0; i < simplex.size; ++i) {
    result.first += simplex.weight[i] * simplex.corner[i].first;
    result.second += simplex.weight[i] * simplex.corner[i].second;
  }
  return result;
}

}  // namespace steadyhand
