#include "steadyhand/geometry/fit/cover.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "steadyhand/core/turn.hpp"
#include "steadyhand/geometry/fit/hull.hpp"
#include "steadyhand/geometry/fit/pieces.hpp"

namespace steadyhand {

namespace {

constexpr double kStep = FittedSolid::kStep, kLeastCore = FittedSolid::kLeastCore;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Sum of uniforms: the standard library's normal distribution differs from library to library.
double normal(std::mt19937& random) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += uniform(random);
  return sum;
}

/// Single precision is enough to search with; what is found is proven in double.
using Numbers = Eigen::ArrayXf;

/// Coordinates of many points, so that they are worked on in lanes.
struct Cloud {
  Numbers x, y, z;

  Cloud() = default;
  explicit Cloud(const Points& points) : x(points.size()), y(points.size()), z(points.size()) {
    for (Eigen::Index i = 0; i < size(); ++i) {
      x[i] = static_cast<float>(points[i].x());
      y[i] = static_cast<float>(points[i].y());
      z[i] = static_cast<float>(points[i].z());
    }
  }
  Eigen::Index size() const { return x.size(); }
};

/// Core of a solid: the box of half extents `half`, of which some may be 0.
struct Core {
  ShapeKind kind = ShapeKind::kSphere;
  Vector3 center = Vector3::Zero();
  Matrix3 R = Matrix3::Identity();
  Vector3 half = Vector3::Zero();
};

/// Distances of points from the core, m; negative inside it.
void distances(const Core& core, const Cloud& cloud, Numbers& result) {
  if (core.kind == ShapeKind::kSphere) {
    const Eigen::Vector3f c = core.center.cast<float>();
    result = ((cloud.x - c[0]).square() + (cloud.y - c[1]).square() + (cloud.z - c[2]).square()).sqrt();
    return;
  }
  const Eigen::Matrix3f R = core.R.transpose().cast<float>();
  const Eigen::Vector3f t = (core.R.transpose() * core.center).cast<float>(), h = core.half.cast<float>();
  if (core.kind == ShapeKind::kCapsule) {
    const Eigen::Vector3f c = core.center.cast<float>();
    result = ((R(2, 0) * cloud.x + R(2, 1) * cloud.y + R(2, 2) * cloud.z - t[2])).max(-h[2]).min(h[2]);
    result = ((cloud.x - c[0] - R(2, 0) * result).square() + (cloud.y - c[1] - R(2, 1) * result).square() +
              (cloud.z - c[2] - R(2, 2) * result).square())
                 .sqrt();
    return;
  }
  static thread_local Numbers a, b, c;
  a = (R(0, 0) * cloud.x + R(0, 1) * cloud.y + R(0, 2) * cloud.z - t[0]).abs() - h[0];
  b = (R(1, 0) * cloud.x + R(1, 1) * cloud.y + R(1, 2) * cloud.z - t[1]).abs() - h[1];
  c = (R(2, 0) * cloud.x + R(2, 1) * cloud.y + R(2, 2) * cloud.z - t[2]).abs() - h[2];
  result = (a.max(0.0f).square() + b.max(0.0f).square() + c.max(0.0f).square()).sqrt() + a.max(b).max(c).min(0.0f);
}

/// A core with the radius that it needs.
struct Ball {
  Core core;
  double radius = 0.0;
};

FittedSolid to_solid(const Ball& ball) {
  FittedSolid solid;
  solid.origin.translation() = ball.core.center;
  solid.origin.linear() = ball.core.R;
  const double radius = std::max(ball.radius, kStep);
  switch (ball.core.kind) {
    case ShapeKind::kCapsule:
      solid.shape = Shape::capsule(ball.core.half.z(), radius);
      break;
    case ShapeKind::kBox:
      solid.shape = Shape::box(ball.core.half, radius);
      break;
    default:
      solid.shape = Shape::sphere(radius);
  }
  return solid;
}

Ball to_ball(const FittedSolid& solid) {
  return {{solid.shape.kind, solid.origin.translation(), solid.origin.linear(), solid.shape.core}, solid.shape.radius};
}

// ---- Parameters that are searched: a core as a vector

using Parameters = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 9, 1>;

int parameter_count(ShapeKind kind) { return kind == ShapeKind::kSphere ? 3 : kind == ShapeKind::kCapsule ? 6 : 9; }

/// @param R the orientation about which a box is searched
Core to_core(ShapeKind kind, const Parameters& p, const Matrix3& R) {
  Core core;
  core.kind = kind;
  if (kind == ShapeKind::kSphere) {
    core.center = p.head<3>();
  } else if (kind == ShapeKind::kCapsule) {
    const Vector3 from = p.head<3>(), to = p.segment<3>(3), way = to - from;
    core.center = 0.5 * (from + to);
    core.half = {0.0, 0.0, 0.5 * way.norm()};
    core.R = turn_between(Vector3::UnitZ(), way).toRotationMatrix();
    if (!core.R.allFinite() || !(core.half.z() > 1e-9)) core.R.setIdentity();
  } else {
    core.center = p.head<3>();
    const Vector3 turn = p.segment<3>(3) / 0.1;  // 1 rad is worth 10 cm
    const double angle = turn.norm();
    core.R = R;
    if (angle > 0.0) core.R = R * Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    core.half = p.tail<3>().cwiseAbs().cwiseMax(kLeastCore);
  }
  return core;
}

/// Principal axes, the longest last, and the box along them.
Ball bounding_box(const Points& points) {
  Vector3 mean = Vector3::Zero();
  for (const Vector3& p : points) mean += p / static_cast<double>(points.size());
  Matrix3 spread = Matrix3::Zero();
  for (const Vector3& p : points) spread += (p - mean) * (p - mean).transpose();
  Matrix3 axes = Eigen::SelfAdjointEigenSolver<Matrix3>(spread).eigenvectors();
  if (!axes.allFinite()) axes.setIdentity();
  if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
  Vector3 low = Vector3::Constant(kInfinity), high = -low;
  for (const Vector3& p : points) {
    low = low.cwiseMin(axes.transpose() * p);
    high = high.cwiseMax(axes.transpose() * p);
  }
  return {{ShapeKind::kBox, axes * (0.5 * (low + high)), axes, 0.5 * (high - low)}, 0.0};
}

/// Minimises by a (1+1) evolution strategy that learns the shape of its steps.
template <typename Cost>
Parameters search(Parameters p, double step, int rounds, std::mt19937& random, const Cost& cost) {
  const auto n = static_cast<int>(p.size());
  const double damping = 1.0 + 0.5 * n, learn = 2.0 / (n * n + 6.0), path_learn = 2.0 / (n + 2.0);
  constexpr double kTarget = 2.0 / 11.0, kAverage = 1.0 / 12.0, kThreshold = 0.44;
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd path = Eigen::VectorXd::Zero(n);
  double success = kTarget, best = cost(p);
  for (int round = 0; round < rounds && step > 1e-6; ++round) {
    Eigen::VectorXd z(n);
    for (int i = 0; i < n; ++i) z[i] = normal(random);
    const Eigen::VectorXd move = A * z;
    const Parameters next = p + step * move;
    const double value = cost(next);
    const bool better = value <= best;
    success = (1.0 - kAverage) * success + kAverage * (better ? 1.0 : 0.0);
    if (better) {
      best = value;
      p = next;
      double share = learn;
      if (success < kThreshold) {
        path = (1.0 - path_learn) * path + std::sqrt(path_learn * (2.0 - path_learn)) * move;
      } else {
        path = (1.0 - path_learn) * path;
        share = learn * (1.0 - path_learn * (2.0 - path_learn));
      }
      const Eigen::MatrixXd C =
          (1.0 - learn) * A * A.transpose() + learn * path * path.transpose() + (learn - share) * A * A.transpose();
      A = C.llt().matrixL();
    }
    step *= std::exp((success - kTarget * (1.0 - success) / (1.0 - kTarget)) / damping);
  }
  return p;
}

// ---- The cover of one link

/// What is to be covered.
struct Mesh : Pieces {
  explicit Mesh(Pieces pieces) : Pieces(std::move(pieces)), cloud(corners) {}
  Cloud cloud;
};

class LinkCover {
 public:
  LinkCover(const Mesh& mesh, const std::vector<CoverProbe>& probes, const CoverSettings& settings)
      : mesh_(mesh), settings_(settings), random_(settings.seed), directions_(even_directions(150)) {
    Points points;
    for (Numbers* numbers : {&gaps_, &shares_, &limits_, &slopes_}) {
      numbers->resize(static_cast<Eigen::Index>(probes.size()));
    }
    for (std::size_t i = 0; i < probes.size(); ++i) {
      points.push_back(probes[i].point);
      const auto at = static_cast<Eigen::Index>(i);
      gaps_[at] = static_cast<float>(probes[i].gap);
      shares_[at] = static_cast<float>(probes[i].share);
      limits_[at] = static_cast<float>(1.0 / probes[i].limit);
      slopes_[at] = static_cast<float>(probes[i].slope);
    }
    probes_ = Cloud(points);
  }

  /// The best of several starts with so many solids.
  std::pair<double, std::vector<Ball>> best_of(int count, const std::vector<Ball>& fewer) {
    std::pair<double, std::vector<Ball>> best{kInfinity, {}};
    const int starts = count == 1 ? 1 : 4;
    for (int start = 0; start < starts; ++start) {
      auto found = from(start == 0 && !fewer.empty() ? split(fewer) : clusters(count));
      if (found.first < best.first) best = std::move(found);
    }
    return best;
  }

  /// These solids, made better.
  std::pair<double, std::vector<Ball>> improve(const std::vector<Ball>& solids) {
    auto found = from(assign(solids));
    std::pair<double, std::vector<Ball>> same{total(solids), solids};
    refine(same);
    return same.first < found.first ? same : found;
  }

 private:
  using Labels = std::vector<int>;  ///< by triangle: the solid that contains it

  Vector3 middle(int t) const {
    const auto& [a, b, c] = mesh_.triangles[t];
    return (mesh_.corners[a] + mesh_.corners[b] + mesh_.corners[c]) / 3.0;
  }

  /// k-means of the triangles' middles.
  Labels clusters(int count) {
    const auto triangles = static_cast<int>(mesh_.triangles.size());
    Points centers;
    for (int i = 0; i < count; ++i) centers.push_back(middle(static_cast<int>(uniform(random_) * triangles)));
    Labels labels(triangles, 0);
    for (int round = 0; round < 12; ++round) {
      Points sums(count, Vector3::Zero());
      std::vector<int> members(count, 0);
      for (int t = 0; t < triangles; ++t) {
        const Vector3 p = middle(t);
        double least = kInfinity;
        for (int i = 0; i < count; ++i) {
          if (const double d = (p - centers[i]).squaredNorm(); d < least) {
            least = d;
            labels[t] = i;
          }
        }
        sums[labels[t]] += p;
        ++members[labels[t]];
      }
      for (int i = 0; i < count; ++i) {
        if (members[i] > 0) centers[i] = sums[i] / members[i];
      }
    }
    return labels;
  }

  /// The solids that there are, the largest one's triangles halved across its longest axis.
  Labels split(const std::vector<Ball>& solids) {
    Labels labels = assign(solids);
    const auto largest = std::max_element(solids.begin(), solids.end(), [&](const Ball& a, const Ball& b) {
      return a.core.half.norm() + a.radius < b.core.half.norm() + b.radius;
    });
    const int index = static_cast<int>(largest - solids.begin());
    Points own;
    for (std::size_t t = 0; t < labels.size(); ++t) {
      if (labels[t] == index) own.push_back(middle(static_cast<int>(t)));
    }
    if (own.empty()) return labels;
    const Ball box = bounding_box(own);
    int axis = 0;
    box.core.half.maxCoeff(&axis);
    const double share = 0.6 * uniform(random_) - 0.3;
    const Vector3 direction = box.core.R.col(axis), at = box.core.center + share * box.core.half[axis] * direction;
    for (std::size_t t = 0; t < labels.size(); ++t) {
      if (labels[t] == index && direction.dot(middle(static_cast<int>(t)) - at) > 0.0) {
        labels[t] = static_cast<int>(solids.size());
      }
    }
    return labels;
  }

  /// Each triangle to the solid that holds it deepest.
  Labels assign(const std::vector<Ball>& solids) {
    std::vector<Numbers> depth(solids.size());
    for (std::size_t i = 0; i < solids.size(); ++i) {
      distances(solids[i].core, mesh_.cloud, depth[i]);
      depth[i] -= static_cast<float>(solids[i].radius);
    }
    Labels labels(mesh_.triangles.size(), 0);
    for (std::size_t t = 0; t < labels.size(); ++t) {
      const auto& [a, b, c] = mesh_.triangles[t];
      double least = kInfinity;
      for (std::size_t i = 0; i < solids.size(); ++i) {
        if (const float d = std::max({depth[i][a], depth[i][b], depth[i][c]}); d < least) {
          least = d;
          labels[t] = static_cast<int>(i);
        }
      }
    }
    return labels;
  }

  Points corners_of(const Labels& labels, int index) const {
    std::vector<bool> used(mesh_.corners.size(), false);
    Points points;
    for (std::size_t t = 0; t < labels.size(); ++t) {
      if (labels[t] != index) continue;
      for (const int corner : mesh_.triangles[t]) {
        if (!used[corner]) points.push_back(mesh_.corners[corner]);
        used[corner] = true;
      }
    }
    return points;
  }

  /// Room that one solid takes from the probes, in addition to others whose distances to the probes are `others`.
  double cost_of(const Core& core, double radius, const Numbers& others) {
    distances(core, probes_, scratch_);
    taken_ = (gaps_ - (scratch_ - static_cast<float>(radius)).min(others)).max(0.0f);
    return cost_of_taken();
  }

  double cost_of_taken() {
    power_ = (taken_ * limits_).min(1.0f).cube();
    for (int i = 0; i < settings_.squarings; ++i) power_ = power_.square();
    return (shares_ * power_ + slopes_ * taken_).sum();
  }

  /// The least radius that holds the points.
  double radius_for(const Core& core, const Cloud& cloud) {
    distances(core, cloud, reach_);
    return std::max(static_cast<double>(reach_.maxCoeff()), kStep);
  }

  /// The solid that holds the points and takes least room.
  Ball fit(const Points& points, const Numbers& others, const Ball* last, int rounds) {
    const Cloud all(points);
    Points some = extreme_points(points, directions_);
    const Ball box = bounding_box(some);
    Ball best;
    double least = kInfinity;
    for (const ShapeKind kind : {ShapeKind::kSphere, ShapeKind::kCapsule, ShapeKind::kBox}) {
      if (kind == ShapeKind::kBox && !settings_.boxes) continue;
      std::vector<std::pair<Parameters, Matrix3>> starts;
      Parameters p(parameter_count(kind));
      if (kind == ShapeKind::kSphere) {
        p = box.core.center;
        starts.emplace_back(p, Matrix3::Identity());
      } else if (kind == ShapeKind::kCapsule) {
        if (last != nullptr && last->core.kind == kind) {
          const Vector3 way = last->core.half.z() * last->core.R.col(2);
          p << last->core.center - way, last->core.center + way;
        } else {
          int axis = 0;
          box.core.half.maxCoeff(&axis);
          const double radius = (box.core.half.sum() - box.core.half[axis]) / 2.0;
          const Vector3 way = std::max(box.core.half[axis] - radius, 1e-3) * box.core.R.col(axis);
          p << box.core.center - way, box.core.center + way;
        }
        starts.emplace_back(p, Matrix3::Identity());
      } else {
        if (last != nullptr && last->core.kind == kind) {
          p << last->core.center, Vector3::Zero(), last->core.half;
          starts.emplace_back(p, last->core.R);
        } else {
          p << box.core.center, Vector3::Zero(), 0.6 * box.core.half;
          starts.emplace_back(p, box.core.R);
          starts.emplace_back(p, Matrix3::Identity());
        }
      }
      for (const auto& [start, R] : starts) {
        Parameters found = start;
        for (int pass = 0; pass < 2; ++pass) {
          const Cloud few(some);
          const auto cost = [&](const Parameters& q) {
            const Core core = to_core(kind, q, R);
            return cost_of(core, radius_for(core, few), others);
          };
          found = search(found, pass == 0 ? 0.01 : 0.002, pass == 0 ? rounds : rounds / 3, random_, cost);
          if (pass > 0) break;
          // What sticks out, of the points that were left out.
          const Core core = to_core(kind, found, R);
          const double radius = radius_for(core, few);
          distances(core, all, reach_);
          if (reach_.maxCoeff() < static_cast<float>(radius) + 1e-5f) break;
          for (Eigen::Index i = 0; i < reach_.size(); ++i) {
            if (reach_[i] > static_cast<float>(radius)) some.push_back(points[static_cast<std::size_t>(i)]);
          }
        }
        Ball ball{to_core(kind, found, R), 0.0};
        ball.radius = radius_for(ball.core, all);
        const double cost =
            cost_of(ball.core, ball.radius, others) + (kind == ShapeKind::kBox ? settings_.box_price : 0.0);
        if (cost < least) {
          least = cost;
          best = ball;
        }
      }
    }
    return best;
  }

  double price_of(const std::vector<Ball>& solids) const {
    double sum = 0.0;
    for (const Ball& ball : solids) sum += ball.core.kind == ShapeKind::kBox ? settings_.box_price : 0.0;
    return sum;
  }

  /// Distances of the probes from the union of all solids but one.
  Numbers without(const std::vector<Ball>& solids, std::size_t one) {
    Numbers least = Numbers::Constant(gaps_.size(), 1e9f);
    for (std::size_t i = 0; i < solids.size(); ++i) {
      if (i == one) continue;
      distances(solids[i].core, probes_, scratch_);
      least = least.min(scratch_ - static_cast<float>(solids[i].radius));
    }
    return least;
  }

  double total(const std::vector<Ball>& solids) {
    const Numbers least = without(solids, solids.size());
    taken_ = (gaps_ - least).max(0.0f);
    return cost_of_taken() + price_of(solids);
  }

  /// Fits and assigns by turns.
  std::pair<double, std::vector<Ball>> from(Labels labels) {
    std::pair<double, std::vector<Ball>> best{kInfinity, {}};
    std::vector<Ball> solids;
    for (int round = 0; round < 6; ++round) {
      const int count = 1 + *std::max_element(labels.begin(), labels.end());
      std::vector<Ball> next;
      for (int i = 0; i < count; ++i) {
        const Points own = corners_of(labels, i);
        if (own.empty()) continue;
        const bool known = solids.size() == static_cast<std::size_t>(count);
        // Fit next to the solids that exist: new ones before index i, those of the last round after it.
        std::vector<Ball> beside = next;
        if (known) beside.insert(beside.end(), solids.begin() + i + 1, solids.end());
        next.push_back(fit(own, without(beside, beside.size()), known ? &solids[i] : nullptr, known ? 300 : 500));
      }
      solids = std::move(next);
      if (const double cost = total(solids); cost < best.first) best = {cost, solids};
      const Labels again = assign(solids);
      if (again == labels) break;
      labels = again;
    }
    refine(best);
    return best;
  }

  /// Each solid in turn need hold only what no other one holds.
  void refine(std::pair<double, std::vector<Ball>>& best) {
    for (int round = 0; round < 3; ++round) {
      const double before = best.first;
      for (std::size_t i = 0; i < best.second.size(); ++i) {
        std::vector<Ball> others = best.second;
        others.erase(others.begin() + static_cast<long>(i));
        std::vector<Ball> tried = best.second;
        Labels labels(mesh_.triangles.size(), 0);
        std::vector<Numbers> depth(others.size());
        for (std::size_t k = 0; k < others.size(); ++k) {
          distances(others[k].core, mesh_.cloud, depth[k]);
          depth[k] -= static_cast<float>(others[k].radius);
        }
        for (std::size_t t = 0; t < labels.size(); ++t) {
          const auto& [a, b, c] = mesh_.triangles[t];
          for (const Numbers& d : depth) {
            if (std::max({d[a], d[b], d[c]}) <= 0.0f) labels[t] = 1;
          }
        }
        const Points own = corners_of(labels, 0);
        if (own.empty()) {
          tried = others;
          if (tried.empty()) continue;
        } else {
          tried[i] = fit(own, without(best.second, i), &best.second[i], 1500);
        }
        if (const double cost = total(tried); cost < best.first) {
          best = {cost, tried};
          if (own.empty()) break;
        }
      }
      if (best.first > before * (1.0 - 1e-3)) break;
    }
  }

  const Mesh& mesh_;
  const CoverSettings& settings_;
  std::mt19937 random_;
  Points directions_;
  Cloud probes_;
  Numbers gaps_, shares_, limits_, slopes_;  // by probe; limits_ holds 1 / limit
  Numbers scratch_, reach_, taken_, power_;
};

}  // namespace

Cover cover(const Surface& surface, const std::vector<CoverProbe>& probes, const CoverSettings& settings,
            const std::vector<FittedSolid>& last) {
  const Mesh mesh(small_triangles(surface));
  LinkCover link(mesh, probes, settings);
  Cover best;
  best.cost = kInfinity;
  const auto take = [&](const std::pair<double, std::vector<Ball>>& found) {
    const double cost = found.first + settings.price * static_cast<double>(found.second.size());
    if (cost >= best.cost) return;
    best.cost = cost;
    best.solids.clear();
    for (const Ball& ball : found.second) best.solids.push_back(rounded(to_solid(ball)));
  };
  std::vector<Ball> fewer;
  int count = 1;
  if (!last.empty()) {
    for (const FittedSolid& solid : last) fewer.push_back(to_ball(solid));
    const auto found = link.improve(fewer);
    fewer = found.second;
    take(found);
    count = std::max(2, static_cast<int>(last.size()));
  }
  for (; count <= settings.most; ++count) {
    const auto found = link.best_of(count, static_cast<int>(fewer.size()) < count ? fewer : std::vector<Ball>{});
    take(found);
    fewer = found.second;
    if (settings.progress) settings.progress(static_cast<double>(count) / settings.most);
  }
  prove(surface, best.solids);
  // A solid that grew to contain one triangle may contain all triangles of another solid.
  for (std::size_t i = best.solids.size(); i-- > 0 && best.solids.size() > 1;) {
    std::vector<FittedSolid> others = best.solids;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    if (is_covered(surface, others)) best.solids = std::move(others);
  }
  return best;
}

}  // namespace steadyhand
