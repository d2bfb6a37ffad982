#include "steadyhand/geometry/collision/proximity.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace steadyhand {
namespace {

using Kind = ShapeKind;

/// Random shapes and placements, from a seed.
class Draw {
 public:
  explicit Draw(int seed) : random_(seed) {}

  double in(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  Vector3 vector(double size) { return {in(-size, size), in(-size, size), in(-size, size)}; }
  Vector3 direction() {
    std::normal_distribution<double> normal;
    return Vector3{normal(random_), normal(random_), normal(random_)}.normalized();
  }
  /// The order in which arguments are computed is the compiler's: what is drawn has a name.
  Shape shape(Kind kind) {
    switch (kind) {
      case Kind::kSphere:
        return Shape::sphere(in(0.02, 0.2));
      case Kind::kCapsule: {
        const double radius = in(0.02, 0.15), half_length = in(0.02, 0.4);
        return Shape::capsule(half_length, radius);
      }
      case Kind::kBox: {
        const double rounding = in(0.0, 1.0) < 0.5 ? 0.0 : in(0.01, 0.1);
        return Shape::box({in(0.02, 0.4), in(0.02, 0.4), in(0.02, 0.4)}, rounding);
      }
      case Kind::kCylinder: {
        const double half_length = in(0.03, 0.3), radius = in(0.03, 0.3);
        return Shape::cylinder(radius, half_length);
      }
      case Kind::kHalfSpace:
        break;
    }
    return Shape::half_space();
  }
  Placed placed(double size) {
    const Vector3 p = vector(size), axis = direction();
    return {p, Eigen::AngleAxisd(in(-M_PI, M_PI), axis).toRotationMatrix()};
  }

 private:
  std::mt19937 random_;
};

/// max over the solid's points of n . x
double support(const Shape& shape, const Placed& at, const Vector3& n) {
  const Vector3 m = at.R.transpose() * n;
  if (shape.kind == Kind::kHalfSpace) {
    return m.z() > 1.0 - 1e-12 ? n.dot(at.p) : std::numeric_limits<double>::infinity();
  }
  if (shape.kind == Kind::kCylinder) {
    return n.dot(at.p) + shape.core.z() * std::abs(m.z()) + shape.core.x() * std::hypot(m.x(), m.y());
  }
  return n.dot(at.p) + shape.core.dot(m.cwiseAbs()) + shape.radius;
}

/// Signed distance by its definition: over all directions, how far the solids are apart in it, at most. A search, which
/// finds it from below.
double searched_distance(const Shape& a, const Placed& A, const Shape& b, const Placed& B, Draw& draw) {
  const auto apart = [&](const Vector3& n) { return -support(b, B, -n) - support(a, A, n); };
  if (a.kind == Kind::kHalfSpace) return apart(A.R.col(2));
  if (b.kind == Kind::kHalfSpace) return apart(-B.R.col(2));
  std::vector<std::pair<double, Vector3>> starts;
  for (int i = 0; i < 600; ++i) {
    const Vector3 n = draw.direction();
    starts.push_back({apart(n), n});
  }
  std::sort(starts.begin(), starts.end(), [](const auto& x, const auto& y) { return x.first > y.first; });
  double best = -1e9;
  for (int i = 0; i < 12; ++i) {  // overlapping boxes have many directions that are best nearby
    auto [value, n] = starts[i];
    for (double step = 0.2; step > 1e-7;) {
      bool better = false;
      for (int tries = 0; tries < 60 && !better; ++tries) {
        const Vector3 next = (n + step * draw.direction()).normalized();
        if (const double there = apart(next); there > value) {
          value = there;
          n = next;
          better = true;
        }
      }
      if (!better) step *= 0.7;
    }
    best = std::max(best, value);
  }
  return best;
}

struct Pairing {
  Kind first, second;
};

std::string name_of(const testing::TestParamInfo<Pairing>& info) {
  return std::string(to_string(info.param.first)) + "_" + std::string(to_string(info.param.second));
}

class EachPair : public testing::TestWithParam<Pairing> {};

bool exact(const Pairing& p) {
  const auto round = [](Kind k) { return k == Kind::kSphere || k == Kind::kCapsule; };
  const bool cylinder = p.first == Kind::kCylinder || p.second == Kind::kCylinder;
  return !cylinder || round(p.first) || round(p.second) || p.first == Kind::kHalfSpace || p.second == Kind::kHalfSpace;
}

TEST_P(EachPair, HasTheDistanceThatASearchFinds) {
  Draw draw(1);
  int apart = 0, overlapping = 0;
  for (int i = 0; i < 150; ++i) {
    const Shape a = draw.shape(GetParam().first), b = draw.shape(GetParam().second);
    const Placed A = draw.placed(0.4), B = draw.placed(0.4);
    const double searched = searched_distance(a, A, b, B, draw), found = distance(a, A, b, B);
    SCOPED_TRACE(i);
    const bool cylinder = a.kind == Kind::kCylinder || b.kind == Kind::kCylinder;
    if (!exact(GetParam()) || (cylinder && searched + 1e-9 < -a.radius - b.radius)) {
      EXPECT_LT(found, searched + 1e-5);  // the distance is never overestimated
    } else {
      EXPECT_GT(found, searched - 1e-7);  // which the search finds from below
      EXPECT_LT(found, searched + 1e-4);
    }
    EXPECT_NEAR(distance(b, B, a, A), found, 1e-9);
    ++(found > 0.0 ? apart : overlapping);
  }
  EXPECT_GT(apart, 5);
  EXPECT_GT(overlapping, 5);
}

TEST_P(EachPair, IsTheSameInLanes) {
  Draw draw(2);
  for (int i = 0; i < 100; ++i) {
    const Shape a = draw.shape(GetParam().first), b = draw.shape(GetParam().second);
    PlacedOf<Lanes> A, B;
    std::vector<Placed> each_a, each_b;
    for (int lane = 0; lane < kLanes; ++lane) {
      each_a.push_back(draw.placed(0.5));
      each_b.push_back(draw.placed(0.5));
      for (int r = 0; r < 3; ++r) {
        A.p[r].set(lane, each_a[lane].p[r]);
        B.p[r].set(lane, each_b[lane].p[r]);
        for (int c = 0; c < 3; ++c) {
          A.R(r, c).set(lane, each_a[lane].R(r, c));
          B.R(r, c).set(lane, each_b[lane].R(r, c));
        }
      }
    }
    const Lanes distances = distance(a, A, b, B), values = proximity_value(a, A, b, B);
    for (int lane = 0; lane < kLanes; ++lane) {
      EXPECT_NEAR(distances[lane], distance(a, each_a[lane], b, each_b[lane]), 1e-9);
      EXPECT_NEAR(values[lane], proximity_value(a, each_a[lane], b, each_b[lane]), 1e-9);
    }
  }
}

/// Two joints in the base that move the second shape, the second of them behind the first.
struct TwoJoints {
  Vector3 axis[2], origin[2];
  Placed moved(const Placed& at, double q0, double q1) const {
    Placed result = at;
    for (const auto& [k, q] : {std::pair{1, q1}, std::pair{0, q0}}) {
      const Matrix3 turn = Eigen::AngleAxisd(q, axis[k]).toRotationMatrix();
      result = {origin[k] + turn * (result.p - origin[k]), turn * result.R};
    }
    return result;
  }
};

TEST_P(EachPair, HasTheDerivativesOfItsValue) {
  if (GetParam().second == Kind::kHalfSpace) GTEST_SKIP() << "a half-space does not move";
  Draw draw(3);
  int compared = 0;
  for (int i = 0; i < 400; ++i) {
    const Shape a = draw.shape(GetParam().first), b = draw.shape(GetParam().second);
    const Placed A = draw.placed(0.5), B = draw.placed(0.5);
    const TwoJoints joints{{draw.direction(), draw.direction()}, {draw.vector(0.5), draw.vector(0.5)}};
    const auto value = [&](double q0, double q1) { return proximity_value(a, A, b, joints.moved(B, q0, q1)); };
    const ProximityOf<double> near = proximity(a, A, b, B);
    EXPECT_NEAR(near.value, value(0.0, 0.0), 1e-12);
    std::vector<MovedOf<double>> moved;
    for (int k = 0; k < 2; ++k) {
      moved.push_back({near, joints.axis[k], joints.axis[k].cross(near.point - joints.origin[k])});
    }
    // Where a feature changes nearby differences of values say nothing: two step sizes must agree.
    const auto differences = [&](double h) {
      Eigen::Matrix<double, 5, 1> d;
      const double here = value(0, 0);
      d << (value(h, 0) - value(-h, 0)) / (2 * h), (value(0, h) - value(0, -h)) / (2 * h),
          (value(h, 0) - 2 * here + value(-h, 0)) / (h * h), (value(0, h) - 2 * here + value(0, -h)) / (h * h),
          (value(h, h) - value(h, -h) - value(-h, h) + value(-h, -h)) / (4 * h * h);
      return d;
    };
    const auto coarse = differences(2e-4), fine = differences(1e-4);
    if ((coarse - fine).norm() > 1e-4 * (1.0 + fine.norm())) continue;
    Eigen::Matrix<double, 5, 1> exact;
    exact << near.gradient.dot(moved[0].point), near.gradient.dot(moved[1].point),
        second_derivative(near, moved[0], moved[0]), second_derivative(near, moved[1], moved[1]),
        second_derivative(near, moved[0], moved[1]);
    SCOPED_TRACE(i);
    EXPECT_LT((exact.head(2) - fine.head(2)).norm(), 1e-5 * (1.0 + fine.head(2).norm()));
    const bool rim = a.kind == Kind::kCylinder || b.kind == Kind::kCylinder;
    if (!rim) {
      EXPECT_LT((exact.tail(3) - fine.tail(3)).norm(), 2e-3 * (1.0 + fine.tail(3).norm()));
    }
    ++compared;
  }
  EXPECT_GT(compared, 200);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, EachPair,
    testing::Values(Pairing{Kind::kSphere, Kind::kSphere}, Pairing{Kind::kSphere, Kind::kCapsule},
                    Pairing{Kind::kCapsule, Kind::kCapsule}, Pairing{Kind::kBox, Kind::kSphere},
                    Pairing{Kind::kSphere, Kind::kBox}, Pairing{Kind::kBox, Kind::kCapsule},
                    Pairing{Kind::kCapsule, Kind::kBox}, Pairing{Kind::kBox, Kind::kBox},
                    Pairing{Kind::kCylinder, Kind::kSphere}, Pairing{Kind::kCylinder, Kind::kCapsule},
                    Pairing{Kind::kCylinder, Kind::kBox}, Pairing{Kind::kCylinder, Kind::kCylinder},
                    Pairing{Kind::kHalfSpace, Kind::kSphere}, Pairing{Kind::kHalfSpace, Kind::kCapsule},
                    Pairing{Kind::kHalfSpace, Kind::kBox}, Pairing{Kind::kHalfSpace, Kind::kCylinder}),
    name_of);

}  // namespace
}  // namespace steadyhand
