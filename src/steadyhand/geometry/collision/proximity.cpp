#include "steadyhand/geometry/collision/proximity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace steadyhand {

namespace {

using std::abs, std::max, std::min, std::sqrt;

constexpr double kTouching = 1e-9;  // m; cores that are nearer than this overlap
constexpr double kZero = 1e-12;

template <typename S>
S clamp(S x, S limit) {
  return max(min(x, limit), -limit);
}

template <typename S>
S sign(S x) {
  return select(x < S(0.0), S(-1.0), S(1.0));
}

template <typename S, typename M>
Vector3Of<S> select3(const M& mask, const Vector3Of<S>& yes, const Vector3Of<S>& no) {
  return {select(mask, yes[0], no[0]), select(mask, yes[1], no[1]), select(mask, yes[2], no[2])};
}

/// The nearest features of two cores.
template <typename S>
struct Features {
  S distance;                  ///< between the cores, signed
  Vector3Of<S> normal;         ///< unit, from the first to the second
  Vector3Of<S> first, second;  ///< nearest points
  std::array<Vector3Of<S>, 2> slide{Vector3Of<S>::Zero(), Vector3Of<S>::Zero()};
  std::array<S, 2> of_second{S(0.0), S(0.0)};
  S length;     ///< distance, or that from a cylinder's axis
  S curvature;  ///< 0 or 1 / length
};

template <typename S>
Features<S> swapped(Features<S> f) {
  std::swap(f.first, f.second);
  f.normal = -f.normal;
  for (S& share : f.of_second) share = 1.0 - share;
  return f;
}

/// yes where the mask is set, else no.
template <typename S, typename M>
Features<S> merge(const M& mask, const Features<S>& yes, const Features<S>& no) {
  Features<S> f;
  f.distance = select(mask, yes.distance, no.distance);
  f.length = select(mask, yes.length, no.length);
  f.curvature = select(mask, yes.curvature, no.curvature);
  f.normal = select3<S>(mask, yes.normal, no.normal);
  f.first = select3<S>(mask, yes.first, no.first);
  f.second = select3<S>(mask, yes.second, no.second);
  for (int i = 0; i < 2; ++i) {
    f.slide[i] = select3<S>(mask, yes.slide[i], no.slide[i]);
    f.of_second[i] = select(mask, yes.of_second[i], no.of_second[i]);
  }
  return f;
}

template <typename S>
S curvature_at(S length) {
  constexpr double kSharpest = 1e-4;  // m; nearer to a sharp corner derivatives say nothing
  return 1.0 / max(length, S(kSharpest));
}

// ---- Points and segments

/// The points of two segments that are nearest: at s along a's, t along b's direction.
template <typename S>
void closest_on_segments(const Vector3Of<S>& between, const Vector3Of<S>& a, double a_half, const Vector3Of<S>& b,
                         double b_half, S& s, S& t) {
  const S cosine = a.dot(b), along_a = a.dot(between), along_b = b.dot(between), sine2 = 1.0 - cosine * cosine;
  const auto parallel = sine2 < S(kZero);
  const S crossing = (along_a - cosine * along_b) / select(parallel, S(1.0), sine2);
  s = select(parallel, S(0.0), clamp(crossing, S(a_half)));
  t = clamp(S(cosine * s - along_b), S(b_half));
  s = clamp(S(cosine * t + along_a), S(a_half));
}

/// Axis of a capsule; 0 for a sphere, whose placement need not have one.
template <typename S>
Vector3Of<S> axis_of(const Shape& shape, const PlacedOf<S>& placed) {
  return shape.core.z() > 0.0 ? Vector3Of<S>(placed.R.col(2)) : Vector3Of<S>(Vector3Of<S>::Zero());
}

/// 1 where a point inside the segment is nearest, else 0.
template <typename S>
S inside(S t, double half) {
  return select(abs(t) < S(half * (1.0 - kZero)), S(1.0), S(0.0));
}

template <typename S>
struct Segments {
  Vector3Of<S> between, point;  ///< from the first's nearest point to the second's; the latter
  std::array<Vector3Of<S>, 2> slide;
};

template <typename S>
Segments<S> closest(const Shape& first, const PlacedOf<S>& at, const Shape& second, const PlacedOf<S>& there) {
  const double a_half = first.core.z(), b_half = second.core.z();
  const Vector3Of<S> centers = there.p - at.p;
  if (a_half == 0.0 && b_half == 0.0) return {centers, there.p, {Vector3Of<S>::Zero(), Vector3Of<S>::Zero()}};
  const Vector3Of<S> a = axis_of(first, at), b = axis_of(second, there);
  S s = 0.0, t = 0.0;
  if (b_half == 0.0)
    s = clamp(S(a.dot(centers)), S(a_half));
  else if (a_half == 0.0)
    t = clamp(S(-b.dot(centers)), S(b_half));
  else
    closest_on_segments<S>(centers, a, a_half, b, b_half, s, t);
  return {centers + t * b - s * a, there.p + t * b, {inside(s, a_half) * a, inside(t, b_half) * b}};
}

/// ProximityOf::value of two round shapes. `between`: from one core's nearest point to the other's.
template <typename S>
S round_value(const Vector3Of<S>& between, double radii) {
  return (between.squaredNorm() - radii * radii) * (0.5 / radii);
}

// ---- Boxes. A segment is a box with two extents of 0, and so are spheres and capsules here.

/// The direction in which two boxes are furthest apart or overlap least. Candidates are the normals of faces and the
/// cross products of edges. Columns of R whose extent is 0 are not read.
template <typename S>
Features<S> least_overlap(const Vector3& a, const PlacedOf<S>& A, const Vector3& b, const PlacedOf<S>& B) {
  const Vector3Of<S> centers = B.p - A.p;
  const auto reach = [](const Vector3& half, const PlacedOf<S>& box, const Vector3Of<S>& direction) {
    S sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      if (half[i] > 0.0) sum += half[i] * abs(S(box.R.col(i).dot(direction)));
    }
    return sum;
  };
  /// Furthest point of a box in the direction.
  const auto support = [](const Vector3& half, const PlacedOf<S>& box, const Vector3Of<S>& direction) {
    Vector3Of<S> point = box.p;
    for (int i = 0; i < 3; ++i) {
      if (half[i] > 0.0) point += (half[i] * sign(S(box.R.col(i).dot(direction)))) * box.R.col(i);
    }
    return point;
  };
  Features<S> best;
  best.distance = -std::numeric_limits<double>::infinity();
  best.normal = best.first = best.second = Vector3Of<S>::Zero();
  best.length = best.curvature = 0.0;

  const auto try_faces = [&](const Vector3& half, const PlacedOf<S>& box, bool of_second) {
    if (half.minCoeff() <= 0.0) return;
    for (int i = 0; i < 3; ++i) {
      Features<S> f;
      const Vector3Of<S> axis = box.R.col(i);
      f.normal = sign(S(axis.dot(centers))) * axis;
      f.distance = f.length = f.normal.dot(centers) - reach(a, A, f.normal) - reach(b, B, f.normal);
      f.curvature = 0.0;
      f.first = of_second ? support(a, A, f.normal) : Vector3Of<S>(Vector3Of<S>::Zero());
      f.second = of_second ? Vector3Of<S>(Vector3Of<S>::Zero()) : support(b, B, -f.normal);
      if (of_second)
        f.second = f.first + f.distance * f.normal;
      else
        f.first = f.second - f.distance * f.normal;
      f.slide = {Vector3Of<S>(box.R.col((i + 1) % 3)), Vector3Of<S>(box.R.col((i + 2) % 3))};
      f.of_second = {S(of_second ? 1.0 : 0.0), S(of_second ? 1.0 : 0.0)};
      best = merge(f.distance > best.distance, f, best);
    }
  };
  try_faces(a, A, false);
  try_faces(b, B, true);
  for (int i = 0; i < 3; ++i) {
    if (a[i] <= 0.0) continue;
    for (int j = 0; j < 3; ++j) {
      if (b[j] <= 0.0) continue;
      const Vector3Of<S> u = A.R.col(i), v = B.R.col(j), product = u.cross(v);
      const S sine2 = product.squaredNorm();
      const auto parallel = sine2 < S(1e-8);
      Features<S> f;
      f.normal = product / sqrt(select(parallel, S(1.0), sine2));
      f.normal = sign(S(f.normal.dot(centers))) * f.normal;
      f.distance = f.normal.dot(centers) - reach(a, A, f.normal) - reach(b, B, f.normal);
      f.distance = f.length = select(parallel, S(-std::numeric_limits<double>::infinity()), f.distance);
      f.curvature = 0.0;
      // The lines of the two edges; their ends may be nearer, but not while this direction has the least overlap.
      const Vector3Of<S> on_a = support(a, A, f.normal), on_b = support(b, B, -f.normal), gap = on_b - on_a;
      const S cosine = u.dot(v);
      const S t = (cosine * u.dot(gap) - v.dot(gap)) / select(parallel, S(1.0), sine2);
      f.second = on_b + t * v;
      f.first = f.second - select(parallel, S(0.0), f.distance) * f.normal;
      f.slide = {u, v};
      f.of_second = {S(0.0), S(1.0)};
      best = merge(f.distance > best.distance, f, best);
    }
  }
  return best;
}

/// Where on the segment c + t u, |t| <= length, in a box's frame, it is nearest to the box, which it does not enter:
/// the distance along the segment is convex and quadratic in pieces.
template <typename S>
S nearest_to_box(const Vector3& half, const Vector3Of<S>& c, const Vector3Of<S>& u, double length) {
  const auto slope = [&](S t) {
    S sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const S x = c[i] + t * u[i];
      sum += u[i] * (x - clamp(x, S(half[i])));
    }
    return sum;
  };
  S t = 0.0;
  if (length > 0.0) {
    S low = -length, high = length, level_low = length, level_high = -length;
    S slope_low = 0.0, slope_high = 0.0;
    const auto look_at = [&](S at) {
      at = clamp(at, S(length));
      const S here = slope(at);
      const auto falls = (here < S(-kZero)) & (at > low - kZero), rises = (here > S(kZero)) & (at < high + kZero);
      const auto level = abs(here) < S(2.0 * kZero);
      low = select(falls, at, low);
      slope_low = select(falls, here, slope_low);
      high = select(rises, at, high);
      slope_high = select(rises, here, slope_high);
      level_low = select(level, min(level_low, at), level_low);
      level_high = select(level, max(level_high, at), level_high);
    };
    look_at(S(-length));
    look_at(S(length));
    for (int i = 0; i < 3; ++i) {
      const S safe = select(abs(u[i]) < S(kZero), S(1.0), u[i]);
      look_at((half[i] - c[i]) / safe);
      look_at((-half[i] - c[i]) / safe);
    }
    const S span = slope_high - slope_low;
    t = select(span > S(kZero), low - slope_low * (high - low) / select(span > S(kZero), span, S(1.0)), low);
    // All of the slope has one sign: at the end to which it falls.
    t = select(slope_high < S(kZero), S(length), t);
    t = select(slope_low > S(-kZero), S(-length), t);
    t = select(level_low < level_high + kZero, 0.5 * (level_low + level_high), t);
  }
  return t;
}

/// A box and a segment that does not enter it.
template <typename S>
Features<S> box_and_segment(const Vector3& half, const PlacedOf<S>& box, const Vector3Of<S>& center,
                            const Vector3Of<S>& axis, double length) {
  const Vector3Of<S> c = box.R.transpose() * (center - box.p), u = box.R.transpose() * axis;
  const S t = nearest_to_box<S>(half, c, u, length);
  Features<S> f;
  const Vector3Of<S> x = c + t * u;
  Vector3Of<S> y, apart;
  std::array<S, 3> free;
  for (int i = 0; i < 3; ++i) {
    y[i] = clamp(x[i], S(half[i]));
    apart[i] = x[i] - y[i];
    free[i] = select(abs(x[i]) < S(half[i]), S(1.0), S(0.0));
  }
  f.distance = f.length = sqrt(S(apart.squaredNorm()));
  f.normal = box.R * (apart / max(f.distance, S(kTouching)));
  f.first = box.p + box.R * y;
  f.second = center + t * axis;
  const S count = free[0] + free[1] + free[2], first_free = free[0], second_free = (1.0 - free[0]) * free[1];
  const S third_free = (1.0 - free[0]) * (1.0 - free[1]) * free[2];
  f.slide[0] = first_free * box.R.col(0) + second_free * box.R.col(1) + third_free * box.R.col(2);
  const auto face = count > S(1.5);
  const Vector3Of<S> other = free[0] * free[1] * box.R.col(1) + (1.0 - free[0] * free[1]) * box.R.col(2);
  f.slide[1] = select3<S>(face, other, inside(t, length) * axis);
  f.of_second = {S(0.0), select(face, S(0.0), S(1.0))};
  f.curvature = select(face, S(0.0), curvature_at(f.length));
  return f;
}

template <typename S>
Features<S> box_and_round(const Shape& box, const PlacedOf<S>& at, const Shape& other, const PlacedOf<S>& there) {
  Features<S> f = box_and_segment<S>(box.core, at, there.p, axis_of(other, there), other.core.z());
  const auto overlap = f.distance < S(kTouching);
  if (any(overlap)) f = merge(overlap, least_overlap(box.core, at, other.core, there), f);
  return f;
}

/// Two boxes that are apart are nearest at an edge of one of them.
template <typename S>
Features<S> box_and_box(const Vector3& a, const PlacedOf<S>& A, const Vector3& b, const PlacedOf<S>& B) {
  Features<S> best;
  const auto try_edges = [&](const Vector3& box, const PlacedOf<S>& at, const Vector3& half, const PlacedOf<S>& there,
                             bool first_has_edges) {
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      for (int corner = 0; corner < 4; ++corner) {
        const Vector3Of<S> center = there.p + ((corner & 1) ? half[j] : -half[j]) * there.R.col(j) +
                                    ((corner & 2) ? half[k] : -half[k]) * there.R.col(k);
        Features<S> f = box_and_segment<S>(box, at, center, there.R.col(i), half[i]);
        if (first_has_edges) f = swapped(f);
        best = !first_has_edges && i == 0 && corner == 0 ? f : merge(f.distance < best.distance, f, best);
      }
    }
  };
  try_edges(a, A, b, B, false);
  try_edges(b, B, a, A, true);
  const auto overlap = best.distance < S(kTouching);
  if (any(overlap)) best = merge(overlap, least_overlap(a, A, b, B), best);
  return best;
}

/// The distance of two boxes' cores; kTouching or less where they overlap. As box_and_box, with the edges of one
/// direction side by side in lanes.
double distance_of_boxes(const Vector3& a, const Placed& A, const Vector3& b, const Placed& B) {
  double least = std::numeric_limits<double>::infinity();  // squared
  const auto try_edges = [&](const Vector3& box, const Placed& at, const Vector3& half, const Placed& there) {
    const Vector3Of<Lanes> p = (at.R.transpose() * (there.p - at.p)).cast<Lanes>();
    const Matrix3Of<Lanes> R = (at.R.transpose() * there.R).cast<Lanes>();
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      for (int corner = 0; corner < 4; corner += kLanes) {
        Lanes along_j, along_k;
        for (int lane = 0; lane < kLanes; ++lane) {
          along_j.set(lane, ((corner + lane) & 1) ? half[j] : -half[j]);
          along_k.set(lane, ((corner + lane) & 2) ? half[k] : -half[k]);
        }
        const Vector3Of<Lanes> c = p + along_j * R.col(j) + along_k * R.col(k);
        const Lanes t = nearest_to_box<Lanes>(box, c, R.col(i), half[i]);
        Lanes squared = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
          const Lanes out = max(abs(c[axis] + t * R(axis, i)) - box[axis], Lanes(0.0));
          squared += out * out;
        }
        least = std::min(least, -largest(-squared));
      }
    }
  };
  try_edges(a, A, b, B);
  try_edges(b, B, a, A);
  return std::sqrt(least);
}

// ---- Cylinders and half-spaces

/// A cylinder and a segment. Its rim counts as the tangent where the segment is nearest.
template <typename S>
Features<S> cylinder_and_segment(const Vector3& core, const PlacedOf<S>& cylinder, const Vector3Of<S>& center,
                                 const Vector3Of<S>& axis, double length) {
  constexpr int kBisections = 40;
  const double radius = core.x(), half = core.z();
  const Vector3Of<S> c = cylinder.R.transpose() * (center - cylinder.p), u = cylinder.R.transpose() * axis;
  const auto across = [](const Vector3Of<S>& x) { return sqrt(S(x[0] * x[0] + x[1] * x[1])); };
  const auto slope = [&](S t) {
    const Vector3Of<S> x = c + t * u;
    const S rho = across(x), out = max(S(0.0), rho - radius) / max(rho, S(kTouching));
    return S(out * (u[0] * x[0] + u[1] * x[1]) + u[2] * (x[2] - clamp(x[2], S(half))));
  };
  S t = 0.0;
  if (length > 0.0) {
    std::array<S, 2> where;  // where the slope stops to fall, and where it begins to rise
    for (int side = 0; side < 2; ++side) {
      S low = -length, high = length;
      for (int i = 0; i < kBisections; ++i) {
        const S middle = 0.5 * (low + high);
        const auto above = slope(middle) > S(side == 0 ? -kZero : kZero);
        high = select(above, middle, high);
        low = select(above, low, middle);
      }
      where[side] = 0.5 * (low + high);
    }
    t = 0.5 * (where[0] + where[1]);
    t = select(slope(S(-length)) > S(kZero), S(-length), t);
    t = select(slope(S(length)) < S(-kZero), S(length), t);
  }
  const Vector3Of<S> z = cylinder.R.col(2);
  Vector3Of<S> x = c + t * u;
  S rho = across(x);
  const auto beyond_end = abs(x[2]) > S(half), beyond_side = rho > S(radius);
  // Overlap: out through an end, or through the side, whichever is nearer.
  const S spread = u[0] * u[0] + u[1] * u[1];
  const S end_depth = abs(c[2]) - half - length * abs(u[2]);
  const S t_side = clamp(S(-(c[0] * u[0] + c[1] * u[1]) / max(spread, S(kZero))), S(length));
  const S side_depth = across(Vector3Of<S>(c + t_side * u)) - radius;
  const auto inside_all = (abs(x[2]) < S(half + kZero)) & (rho < S(radius + kZero));
  const auto through_end = inside_all & (end_depth > side_depth);
  t = select(inside_all, select(through_end, S(-length * sign(S(c[2] * u[2]))), t_side), t);
  x = c + t * u;
  rho = across(x);

  const auto end = through_end | (beyond_end & (rho < S(radius)));
  const auto side = (inside_all & (end_depth < side_depth + kZero)) | ((abs(x[2]) < S(half)) & beyond_side);
  const S safe_rho = max(rho, S(kTouching));
  const Vector3Of<S> radial =
      select3<S>(rho < S(kTouching), Vector3Of<S>(cylinder.R.col(0)),
                 Vector3Of<S>((x[0] / safe_rho) * cylinder.R.col(0) + (x[1] / safe_rho) * cylinder.R.col(1)));
  const S out_z = x[2] - sign(S(select(inside_all, S(c[2]), S(x[2])))) * half, out_r = rho - radius;
  Features<S> f;
  f.second = center + t * axis;
  const S rim = sqrt(S(out_z * out_z + out_r * out_r));
  f.distance = select(end, sign(S(select(inside_all, S(c[2]), S(x[2])))) * out_z, select(side, out_r, rim));
  const Vector3Of<S> up = sign(S(select(inside_all, S(c[2]), S(x[2])))) * z;
  f.normal = select3<S>(end, up,
                        select3<S>(side, radial, Vector3Of<S>((out_z * z + out_r * radial) / max(rim, S(kTouching)))));
  f.first = f.second - f.distance * f.normal;
  f.length = select(side, rho, f.distance);
  f.curvature = select(end, S(0.0), curvature_at(f.length));
  const Vector3Of<S> tangent = z.cross(radial);
  f.slide[0] = select3<S>(end, Vector3Of<S>(cylinder.R.col(0)), select3<S>(side, z, tangent));
  f.slide[1] = select3<S>(end, Vector3Of<S>(cylinder.R.col(1)), Vector3Of<S>(inside(t, length) * axis));
  f.of_second = {S(0.0), select(end, S(0.0), S(1.0))};
  return f;
}

/// The second shape's deepest point. On a cylinder's rim the point is treated as fixed to the cylinder.
template <typename S>
Features<S> half_space_and(const PlacedOf<S>& plane, const Shape& other, const PlacedOf<S>& there) {
  Features<S> f;
  f.normal = plane.R.col(2);
  f.second = there.p;
  for (int i = 0; i < 3; ++i) {
    if (other.core[i] <= 0.0 || (other.kind == ShapeKind::kCylinder && i < 2)) continue;
    f.second -= (other.core[i] * sign(S(there.R.col(i).dot(f.normal)))) * there.R.col(i);
  }
  if (other.kind == ShapeKind::kCylinder) {
    const Vector3Of<S> z = there.R.col(2), across = f.normal - z.dot(f.normal) * z;
    f.second -= (other.core.x() / max(sqrt(S(across.squaredNorm())), S(kTouching))) * across;
  }
  f.distance = f.length = f.normal.dot(f.second - plane.p);
  f.first = f.second - f.distance * f.normal;
  f.slide = {Vector3Of<S>(plane.R.col(0)), Vector3Of<S>(plane.R.col(1))};
  f.curvature = 0.0;
  return f;
}

/// Of any two shapes that are not both round.
template <typename S>
Features<S> nearest(const Shape& first, const PlacedOf<S>& at, const Shape& second, const PlacedOf<S>& there) {
  if (first.kind == ShapeKind::kHalfSpace) return half_space_and(at, second, there);
  if (second.kind == ShapeKind::kHalfSpace) return swapped(half_space_and(there, first, at));
  if (first.is_round()) return swapped(nearest(second, there, first, at));
  if (!second.is_round()) return box_and_box(first.core, at, second.core, there);
  if (first.kind == ShapeKind::kBox) return box_and_round(first, at, second, there);
  return cylinder_and_segment<S>(first.core, at, there.p, axis_of(second, there), second.core.z());
}

}  // namespace

// With r from the first nearest point to the second, F = r^2 / 2, and the points free to slide along the columns of T,
// the derivative of F by the joints is r . r_q and its second derivative
//   r . r_qq + r_q . r_q - a' T'T a - (a' N + N' a) - N' (T'T)^-1 N,   a = (T'T)^-1 T' r_q,   N = r . T_q,
// when the slides follow the joints so that F stays minimal. The derivatives of the distance |r|, and of
// ProximityOf::value between round shapes, follow by the chain rule.

namespace {

/// Solves T'T x = b for the slides of a proximity; what has no slide gets 0.
template <typename S>
std::array<S, 2> solve_slides(const ProximityOf<S>& near, const std::array<S, 2>& b) {
  constexpr double kParallel = 1e-6;
  const S first = near.slide[0].squaredNorm(), second = near.slide[1].squaredNorm();
  const S cosine = near.slide[0].dot(near.slide[1]), determinant = first * second - cosine * cosine;
  const auto both = determinant > S(kParallel);
  const S scale = select(both, 1.0 / select(both, determinant, S(1.0)), S(0.0));
  // Parallel or single slides: the first takes all, or if there is none the second.
  const auto only_second = first < S(0.5);
  return {select(both, (second * b[0] - cosine * b[1]) * scale, select(only_second, S(0.0), b[0])),
          select(both, (first * b[1] - cosine * b[0]) * scale, select(only_second, b[1], S(0.0)))};
}

template <typename S>
S dot(const std::array<S, 2>& a, const std::array<S, 2>& b) {
  return a[0] * b[0] + a[1] * b[1];
}

}  // namespace

template <typename S>
MovedOf<S>::MovedOf(const ProximityOf<S>& near, const Vector3Of<S>& axis_, const Vector3Of<S>& point_)
    : axis(axis_), point(point_) {
  along = solve_slides<S>(near, {near.slide[0].dot(point), near.slide[1].dot(point)});
  for (int i = 0; i < 2; ++i) turned[i] = near.of_second[i] * near.gradient.dot(axis.cross(near.slide[i]));
}

template <typename S>
S second_derivative(const ProximityOf<S>& near, const MovedOf<S>& before, const MovedOf<S>& after) {
  const auto& T = near.slide;
  const Vector3Of<S> slid_before = before.along[0] * T[0] + before.along[1] * T[1];
  const Vector3Of<S> slid_after = after.along[0] * T[0] + after.along[1] * T[1];
  S across = before.point.dot(after.point) - slid_before.dot(slid_after);
  if (!near.round) across -= near.gradient.dot(before.point) * near.gradient.dot(after.point);
  return near.gradient.dot(before.axis.cross(after.point)) - dot(before.along, after.turned) -
         dot(after.along, before.turned) - near.length * dot(before.turned, solve_slides(near, after.turned)) +
         near.curvature * across;
}

bool is_further(double least, const Shape& first, const Placed& at, const Shape& second, const Placed& there) {
  const double sum = std::max(least, 0.0) + first.extent() + second.extent();  // infinite for half-spaces
  return (at.p - there.p).squaredNorm() > sum * sum;
}

template <typename S>
S distance(const Shape& first, const PlacedOf<S>& at, const Shape& second, const PlacedOf<S>& there) {
  const double radii = first.radius + second.radius;
  if (first.is_round() && second.is_round())
    return sqrt(S(closest(first, at, second, there).between.squaredNorm())) - radii;
  if constexpr (std::is_same_v<S, double>) {
    if (first.kind == ShapeKind::kBox && second.kind == ShapeKind::kBox) {
      const double apart = distance_of_boxes(first.core, at, second.core, there);
      if (apart > kTouching) return apart - radii;
    }
  }
  return nearest(first, at, second, there).distance - radii;
}

template <typename S>
S proximity_value(const Shape& first, const PlacedOf<S>& at, const Shape& second, const PlacedOf<S>& there) {
  if (!first.is_round() || !second.is_round()) return distance(first, at, second, there);
  return round_value(closest(first, at, second, there).between, first.radius + second.radius);
}

template <typename S>
ProximityOf<S> proximity(const Shape& first, const PlacedOf<S>& at, const Shape& second, const PlacedOf<S>& there) {
  const double radii = first.radius + second.radius;
  if (first.is_round() && second.is_round()) {
    const Segments<S> near = closest(first, at, second, there);
    return {round_value(near.between, radii),
            near.between / S(radii),
            near.point,
            near.slide,
            {S(0.0), S(1.0)},
            radii,
            1.0 / radii,
            true};
  }
  const Features<S> f = nearest(first, at, second, there);
  return {f.distance - radii, f.normal, f.second, f.slide, f.of_second, f.length, f.curvature, false};
}

#define STEADYHAND_PROXIMITY(S)                                                                   \
  template struct MovedOf<S>;                                                                     \
  template S second_derivative(const ProximityOf<S>&, const MovedOf<S>&, const MovedOf<S>&);      \
  template S distance(const Shape&, const PlacedOf<S>&, const Shape&, const PlacedOf<S>&);        \
  template S proximity_value(const Shape&, const PlacedOf<S>&, const Shape&, const PlacedOf<S>&); \
  template ProximityOf<S> proximity(const Shape&, const PlacedOf<S>&, const Shape&, const PlacedOf<S>&);
STEADYHAND_PROXIMITY(double)
STEADYHAND_PROXIMITY(Lanes)
#undef STEADYHAND_PROXIMITY

}  // namespace steadyhand
