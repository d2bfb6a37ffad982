#include "steadyhand/geometry/fit/free_space.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <random>

#include "steadyhand/geometry/robot/joint_search.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/geometry/robot/pairs.hpp"

namespace steadyhand {

namespace {

constexpr double kNear = 0.06;          // m; links that come so near are worth room between them
constexpr double kBall = 0.04;          // m, about the radius of an arm's tubes
constexpr double kPartner = 0.5;        // share of the room between two links that the cover of one may take
constexpr double kLeastLimit = 0.002;   // m
constexpr std::size_t kProbes = 3000;   // per link, at most
constexpr std::size_t kAround = 500;    // probes all around a link, for obstacles
constexpr double kAroundWeight = 0.12;  // 1/m: share of free space that a metre of room all around counts

}  // namespace

Poses poses_at(const RobotModel& model, const JointVector& q) {
  Poses poses{Eigen::Isometry3d::Identity()};
  for (int k = 0; k < model.dof(); ++k) {
    poses.push_back(poses[model.parent(k)] * model.joints[k].origin * motion(model.joints[k], q[k]));
  }
  return poses;
}

std::vector<Part> make_parts(const std::vector<FittedLink>& links, const UrdfChain& chain, int directions) {
  std::vector<Part> parts;
  for (std::size_t row = 0; row < links.size(); ++row) {
    const UrdfChain::Frame& frame = chain.frames.at(links[row].link);
    for (const Hull& hull : links[row].parts) {
      Part part;
      part.link = frame.link;
      part.row = row;
      part.corners = directions > 0 ? extreme_points(hull.corners, even_directions(directions)) : hull.corners;
      Vector3 low = Vector3::Constant(1e9), high = -low;
      for (Vector3& corner : part.corners) {
        corner = frame.X_link_frame * corner;
        low = low.cwiseMin(corner);
        high = high.cwiseMax(corner);
      }
      part.center = 0.5 * (low + high);
      for (const Vector3& corner : part.corners) part.extent = std::max(part.extent, (corner - part.center).norm());
      parts.push_back(std::move(part));
    }
  }
  return parts;
}

Nearest nearest_of(const Part& a, const Part& b, const Poses& poses, double enough) {
  const Eigen::Isometry3d motion = poses[a.link].inverse() * poses[b.link];
  const double apart = (motion * b.center - a.center).norm() - a.extent - b.extent;
  if (apart > enough) return {apart, Vector3::Zero(), Vector3::Zero()};
  return nearest_points(a.corners, b.corners, motion, enough);
}

bool parts_touch(const RobotModel& model, const std::vector<Part>& parts, const Poses& poses, const RowPairs& but) {
  for (const Part& first : parts) {
    for (const Part& second : parts) {
      if (!may_be_pair(model, first.link, second.link) || but.contains({first.row, second.row})) continue;
      if (nearest_of(first, second, poses, 0.0).distance <= 0.0) return true;
    }
  }
  return false;
}

RowPairs links_together(const RobotModel& model, const std::vector<Part>& parts, std::uint32_t seed) {
  constexpr int kLooks = 300;
  RowPairs together;
  for (const Part& first : parts) {
    for (const Part& second : parts) {
      if (may_be_pair(model, first.link, second.link)) together.emplace(first.row, second.row);
    }
  }
  const JointBox box(model);
  std::mt19937 random(seed);
  for (int look = 0; look < kLooks && !together.empty(); ++look) {
    const Poses poses = poses_at(model, box.sample(random));
    RowPairs touching;
    for (const Part& first : parts) {
      for (const Part& second : parts) {
        const std::pair rows(first.row, second.row);
        if (!together.contains(rows) || touching.contains(rows)) continue;
        if (nearest_of(first, second, poses, 0.0).distance <= 0.0) touching.insert(rows);
      }
    }
    together = std::move(touching);
  }
  return together;
}

std::vector<Poses> free_poses(const RobotModel& model, const std::vector<Part>& parts, const RowPairs& together,
                              std::uint32_t seed, const std::function<void(double)>& progress) {
  constexpr int kProbed = 12'000;
  const JointBox box(model);
  std::mt19937 random(seed);
  std::vector<Poses> free;
  for (int c = 0; c < kProbed; ++c) {
    if (c % 500 == 0) progress(static_cast<double>(c) / kProbed);
    Poses poses = poses_at(model, box.sample(random));
    if (!parts_touch(model, parts, poses, together)) free.push_back(std::move(poses));
  }
  return free;
}

RowPairs links_apart(const RobotModel& model, const std::vector<Part>& parts) {
  constexpr double kClear = 1e-3;  // m: more than by which convex parts are smaller than what they hold
  std::map<std::size_t, std::vector<Points>> corners;
  std::map<std::size_t, int> links;
  for (const Part& part : parts) {
    corners[part.row].push_back(part.corners);
    links[part.row] = part.link;
  }
  RowPairs apart;
  for (const auto& [a, link_a] : links) {
    for (const auto& [b, link_b] : links) {
      if (link_a < link_b && way_between(model, link_a, link_b).size() == 2 &&
          !parts_may_meet(model, link_a, corners[a], link_b, corners[b], kClear))
        apart.emplace(a, b);
    }
  }
  return apart;
}

std::vector<Fitted> cores_of(const std::vector<FittedSolid>& solids, std::size_t row, const UrdfChain::Frame& frame) {
  std::vector<Fitted> fitted;
  for (const FittedSolid& solid : solids) {
    Fitted one;
    one.link = frame.link;
    one.row = row;
    one.radius = solid.shape.radius;
    for (int corner = 0; corner < 8; ++corner) {
      Vector3 at;
      bool twice = false;
      for (int i = 0; i < 3; ++i) {
        const bool far = (corner >> i & 1) != 0;
        twice = twice || (far && solid.shape.core[i] == 0.0);
        at[i] = far ? solid.shape.core[i] : -solid.shape.core[i];
      }
      if (!twice) one.corners.push_back(frame.X_link_frame * solid.origin * at);
    }
    one.center = frame.X_link_frame * solid.origin.translation();
    one.extent = solid.shape.core.norm();
    fitted.push_back(std::move(one));
  }
  return fitted;
}

std::vector<CoverProbe> probes_of(const RobotModel& model, std::size_t row, const std::vector<Part>& parts,
                                  const std::vector<std::vector<Fitted>>& bodies, const std::vector<Poses>& free,
                                  const RowPairs& left_out, const UrdfChain::Frame& frame, std::uint32_t seed) {
  std::vector<CoverProbe> probes;
  const auto may_touch = [&](int a, int b) { return may_be_pair(model, std::min(a, b), std::max(a, b)); };
  for (const Poses& poses : free) {
    const Eigen::Isometry3d X_frame_base = (poses[frame.link] * frame.X_link_frame).inverse();
    for (std::size_t other = 0; other < bodies.size(); ++other) {
      if (left_out.contains({row, other}) || left_out.contains({other, row})) continue;
      CoverProbe nearest;
      nearest.limit = std::numeric_limits<double>::infinity();
      for (const Part& own : parts) {
        if (own.row != row) continue;
        for (const Fitted& body : bodies[other]) {
          if (!may_touch(body.link, own.link)) continue;
          const Nearest found = nearest_of(own, body, poses, kNear + body.radius);
          const double room = found.distance - body.radius;
          if (room > kNear || room >= nearest.limit) continue;
          nearest.point = X_frame_base * (poses[own.link] * found.second);
          nearest.gap = found.distance;
          nearest.limit = room;
        }
        if (!bodies[other].empty()) continue;
        for (const Part& part : parts) {
          if (part.row != other || !may_touch(part.link, own.link)) continue;
          const Nearest found = nearest_of(own, part, poses, kNear);
          if (found.distance > kNear || found.distance <= 0.0 || kPartner * found.distance >= nearest.limit) continue;
          const Vector3 beyond = kBall * (found.second - found.first) / found.distance;
          nearest.point = X_frame_base * (poses[own.link] * Vector3(found.second + beyond));
          nearest.gap = found.distance + kBall;
          nearest.limit = kPartner * found.distance;
        }
      }
      // What the other's bodies take from this link itself, no cover can give back.
      if (nearest.limit > 0.0 && nearest.limit < kNear) {
        nearest.limit = std::max(nearest.limit, kLeastLimit);
        probes.push_back(nearest);
      }
    }
  }
  const auto all = static_cast<double>(probes.size());
  if (probes.size() > kProbes) {
    std::mt19937 random(seed);
    for (std::size_t i = 0; i < kProbes; ++i) {
      std::swap(probes[i],
                probes[i + static_cast<std::size_t>(uniform(random) * static_cast<double>(probes.size() - i))]);
    }
    probes.resize(kProbes);
  }
  for (CoverProbe& probe : probes) {
    probe.share = all / static_cast<double>(probes.size()) / static_cast<double>(free.size());
    probe.slope = 0.05 * probe.share / kNear;
  }
  return probes;
}

void add_probes_around(const std::vector<Hull>& parts, std::uint32_t seed, std::vector<CoverProbe>& probes) {
  struct Facet {
    const Triangle* triangle;
    double until;  // area of it and those before
  };
  std::vector<Facet> facets;
  double area = 0.0;
  for (const Hull& part : parts) {
    for (const Triangle& t : part.faces) {
      area += 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
      facets.push_back({&t, area});
    }
  }
  if (!(area > 0.0)) return;
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < kAround; ++i) {
    const double at = area * (static_cast<double>(i) + uniform(random)) / kAround;
    const auto facet = std::lower_bound(facets.begin(), facets.end(), at,
                                        [](const Facet& f, double value) { return f.until < value; });
    if (facet == facets.end()) continue;
    const auto& [a, b, c] = *facet->triangle;
    double u = uniform(random), v = uniform(random);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const Vector3 p = a + u * (b - a) + v * (c - a) + kBall * (b - a).cross(c - a).normalized();
    double gap = kBall;
    for (const Hull& part : parts) {
      const Nearest near = nearest_points(part.corners, {p}, Eigen::Isometry3d::Identity(), kBall);
      gap = std::min(gap, near.distance);
    }
    if (gap > 0.0) probes.push_back({p, gap, 0.0, 1.0, kAroundWeight / kAround});
  }
}

int count_refused(const RobotModel& model, const std::vector<std::vector<Fitted>>& bodies,
                  const std::vector<Poses>& free, const RowPairs& left_out) {
  int refused = 0;
  for (const Poses& poses : free) {
    bool touches = false;
    for (std::size_t a = 0; a < bodies.size() && !touches; ++a) {
      for (std::size_t b = 0; b < bodies.size() && !touches; ++b) {
        if (left_out.contains({a, b})) continue;
        for (const Fitted& first : bodies[a]) {
          for (const Fitted& second : bodies[b]) {
            if (touches || !may_be_pair(model, first.link, second.link)) continue;
            const double reach = first.radius + second.radius;
            touches = nearest_of(first, second, poses, reach).distance < reach;
          }
        }
      }
    }
    refused += touches;
  }
  return refused;
}

}  // namespace steadyhand
