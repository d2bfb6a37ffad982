#include "steadyhand/geometry/fit/fit.hpp"

#include <fmt/format.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/fit/cover.hpp"
#include "steadyhand/geometry/fit/link_geometry.hpp"
#include "steadyhand/geometry/robot/joint_search.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/geometry/robot/pairs.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"
#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

constexpr double kNear = 0.06;          // m; links that come so near are worth room between them
constexpr double kBall = 0.04;          // m, about the radius of an arm's tubes
constexpr double kPartner = 0.5;        // of the room between two links, that the cover of one may take
constexpr double kLeastLimit = 0.002;   // m
constexpr int kProbed = 12'000;         // configurations
constexpr std::size_t kProbes = 3000;   // of a link, at most
constexpr std::size_t kAround = 500;    // probes all around a link, for whatever stands there
constexpr double kAroundWeight = 0.12;  // 1/m: share of free space that a metre of room all around counts
constexpr double kPrice = 2e-4;         // share of free space that a body must be worth
constexpr double kBoxPrice = 2e-4;      // and a box, whose distances take longer
constexpr double kMargin = 0.02;        // m; pairs that cannot come so near are left out
constexpr double kLeastCut = 0.004;     // of the volume, that a cut into convex parts must take away
constexpr int kMostParts = 10;
constexpr std::size_t kMostSearched = 60'000;  // of a link, that searching looks at

/// What a cover is searched for: of very many triangles the convex parts, which are a little smaller (prove() is given
/// the triangles).
Surface searched(const Surface& surface, const std::vector<Hull>& parts) {
  if (surface.size() <= kMostSearched) return surface;
  Surface faces;
  for (const Hull& part : parts) faces.insert(faces.end(), part.faces.begin(), part.faces.end());
  return faces;
}

/// Poses of all links in the base.
std::vector<Eigen::Isometry3d> poses_at(const RobotModel& model, const JointVector& q) {
  std::vector<Eigen::Isometry3d> poses{Eigen::Isometry3d::Identity()};
  for (int k = 0; k < model.dof(); ++k) {
    poses.push_back(poses.back() * model.joints[k].origin * motion(model.joints[k], q[k]));
  }
  return poses;
}

/// A convex part on a link of the chain.
struct Part {
  int link = 0;
  std::size_t row = 0;  ///< of FitResult::links
  Points corners;       ///< in the frame of that link
  Vector3 center = Vector3::Zero();
  double extent = 0.0;
};

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

Nearest nearest_of(const Part& a, const Part& b, const std::vector<Eigen::Isometry3d>& poses, double enough) {
  const Eigen::Isometry3d motion = poses[a.link].inverse() * poses[b.link];
  const double apart = (motion * b.center - a.center).norm() - a.extent - b.extent;
  if (apart > enough) return {apart, Vector3::Zero(), Vector3::Zero()};
  return nearest_points(a.corners, b.corners, motion, enough);
}

using Poses = std::vector<Eigen::Isometry3d>;  ///< of all links of the chain, in the base

/// Pairs of rows of FitResult::links.
using RowPairs = std::set<std::pair<std::size_t, std::size_t>>;

/// Whether convex parts of two links touch that are no neighbours, but for these pairs of rows.
bool parts_touch(const std::vector<Part>& parts, const Poses& poses, const RowPairs& but) {
  for (const Part& first : parts) {
    for (const Part& second : parts) {
      if (second.link < first.link + 2 || but.contains({first.row, second.row})) continue;
      if (nearest_of(first, second, poses, 0.0).distance <= 0.0) return true;
    }
  }
  return false;
}

/// Pairs of rows whose convex parts touch in each of some random configurations, as a shoulder in its torso's shell:
/// the arm cannot help it.
RowPairs links_together(const RobotModel& model, const std::vector<Part>& parts, std::uint32_t seed) {
  constexpr int kLooks = 300;
  RowPairs together;
  for (const Part& first : parts) {
    for (const Part& second : parts) {
      if (second.link >= first.link + 2) together.emplace(first.row, second.row);
    }
  }
  const JointBox box(model, 0, model.dof());
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

/// Random configurations in which the convex parts are apart, but for these pairs of rows.
std::vector<Poses> free_poses(const RobotModel& model, const std::vector<Part>& parts, const RowPairs& together,
                              std::uint32_t seed, const std::function<void(double)>& progress) {
  const JointBox box(model, 0, model.dof());
  std::mt19937 random(seed);
  std::vector<Poses> free;
  for (int c = 0; c < kProbed; ++c) {
    if (c % 500 == 0) progress(static_cast<double>(c) / kProbed);
    Poses poses = poses_at(model, box.sample(random));
    if (!parts_touch(parts, poses, together)) free.push_back(std::move(poses));
  }
  return free;
}

/// Pairs of rows that stand apart in every configuration, the first one nearer to the base. Of links with two joints
/// between them: with more, the search does not end.
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
      if (link_b == link_a + 2 && !parts_may_meet(model, link_a, corners[a], link_b, corners[b], kClear))
        apart.emplace(a, b);
    }
  }
  return apart;
}

/// The bodies of a link as they stand: a core's corners and a radius about them.
struct Fitted {
  int link = 0;
  std::size_t row = 0;
  Part core;
  double radius = 0.0;
};

std::vector<Fitted> cores_of(const std::vector<Solid>& solids, std::size_t row, const UrdfChain::Frame& frame) {
  std::vector<Fitted> fitted;
  for (const Solid& solid : solids) {
    Fitted one;
    one.link = one.core.link = frame.link;
    one.row = one.core.row = row;
    one.radius = solid.shape.radius;
    for (int corner = 0; corner < 8; ++corner) {
      Vector3 at;
      bool twice = false;
      for (int i = 0; i < 3; ++i) {
        const bool far = (corner >> i & 1) != 0;
        twice = twice || (far && solid.shape.core[i] == 0.0);
        at[i] = far ? solid.shape.core[i] : -solid.shape.core[i];
      }
      if (!twice) one.core.corners.push_back(frame.X_link_frame * solid.origin * at);
    }
    one.core.center = frame.X_link_frame * solid.origin.translation();
    one.core.extent = solid.shape.core.norm();
    fitted.push_back(std::move(one));
  }
  return fitted;
}

/// Where other links come near one of them: near their bodies, where they have some, else near their convex parts.
std::vector<Probe> probes_of(std::size_t row, const std::vector<Part>& parts,
                             const std::vector<std::vector<Fitted>>& bodies, const std::vector<Poses>& free,
                             const RowPairs& left_out, const UrdfChain::Frame& frame, std::uint32_t seed) {
  std::vector<Probe> probes;
  for (const Poses& poses : free) {
    const Eigen::Isometry3d X_frame_base = (poses[frame.link] * frame.X_link_frame).inverse();
    for (std::size_t other = 0; other < bodies.size(); ++other) {
      if (left_out.contains({row, other}) || left_out.contains({other, row})) continue;
      Probe nearest;
      nearest.limit = std::numeric_limits<double>::infinity();
      for (const Part& own : parts) {
        if (own.row != row) continue;
        for (const Fitted& body : bodies[other]) {
          if (std::abs(body.link - own.link) < 2) continue;
          const Nearest found = nearest_of(own, body.core, poses, kNear + body.radius);
          const double room = found.distance - body.radius;
          if (room > kNear || room >= nearest.limit) continue;
          nearest.point = X_frame_base * (poses[own.link] * found.second);
          nearest.gap = found.distance;
          nearest.limit = room;
        }
        if (!bodies[other].empty()) continue;
        for (const Part& part : parts) {
          if (part.row != other || std::abs(part.link - own.link) < 2) continue;
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
  for (Probe& probe : probes) {
    probe.share = all / static_cast<double>(probes.size()) / static_cast<double>(free.size());
    probe.slope = 0.05 * probe.share / kNear;
  }
  return probes;
}

/// Configurations that the bodies refuse.
int count_refused(const std::vector<std::vector<Fitted>>& bodies, const std::vector<Poses>& free,
                  const RowPairs& left_out) {
  int refused = 0;
  for (const Poses& poses : free) {
    bool touches = false;
    for (std::size_t a = 0; a < bodies.size() && !touches; ++a) {
      for (std::size_t b = 0; b < bodies.size() && !touches; ++b) {
        if (left_out.contains({a, b})) continue;
        for (const Fitted& first : bodies[a]) {
          for (const Fitted& second : bodies[b]) {
            if (touches || second.link < first.link + 2) continue;
            const double reach = first.radius + second.radius;
            touches = nearest_of(first.core, second.core, poses, reach).distance < reach;
          }
        }
      }
    }
    refused += touches;
  }
  return refused;
}

/// Probes evenly over the surface of the convex parts.
void add_probes_around(const std::vector<Hull>& parts, std::uint32_t seed, std::vector<Probe>& probes) {
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

bool inside(const Hull& hull, const Vector3& p) {
  return std::all_of(hull.faces.begin(), hull.faces.end(),
                     [&](const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]).dot(p - t[0]) <= 0.0; });
}

/// Volumes by even sampling of the box about all.
void measure(const Surface& surface, const std::vector<Solid>& solids, FittedLink& link) {
  constexpr int kSamples = 40;  // along each axis
  Points corners;
  for (const Triangle& t : surface) corners.insert(corners.end(), t.begin(), t.end());
  link.hull = convex_hull(corners).volume;
  Vector3 low = Vector3::Constant(1e9), high = -low;
  for (const Solid& solid : solids) {
    low = low.cwiseMin(solid.origin.translation() - Vector3::Constant(solid.shape.extent()));
    high = high.cwiseMax(solid.origin.translation() + Vector3::Constant(solid.shape.extent()));
  }
  int covered = 0, filled = 0;
  for (int i = 0; i < kSamples * kSamples * kSamples; ++i) {
    const Vector3 share((i % kSamples + 0.5) / kSamples, (i / kSamples % kSamples + 0.5) / kSamples,
                        (i / kSamples / kSamples + 0.5) / kSamples);
    const Vector3 p = low + share.cwiseProduct(high - low);
    if (std::none_of(solids.begin(), solids.end(), [&](const Solid& s) { return s.distance(p) <= 0.0; })) continue;
    ++covered;
    filled += std::any_of(link.parts.begin(), link.parts.end(), [&](const Hull& hull) { return inside(hull, p); });
  }
  const double cell = (high - low).prod() / (kSamples * kSamples * kSamples);
  link.cover = covered * cell;
  link.solid = filled * cell;
}

/// Says what of the configurations is free and refused.
void judge(const UrdfChain& chain, const FitSettings& settings, const RowPairs& together, FitResult& result) {
  const RobotModel& model = result.model;
  const std::vector<Part> parts = make_parts(result.links, chain, 0);
  const JointBox box(model, 0, model.dof());
  std::mt19937 random(settings.seed + 1);
  std::map<std::pair<int, int>, int> blame;
  for (int c = 0; c < settings.judged; ++c) {
    if (c % 1000 == 0 && settings.progress) settings.progress("judging", 0.75 + 0.25 * c / settings.judged);
    const auto poses = poses_at(model, box.sample(random));
    std::vector<Placed> placed;
    for (const Body& body : model.bodies) {
      const Eigen::Isometry3d X = poses[body.link] * body.origin;
      placed.push_back({X.translation(), X.linear()});
    }
    std::pair<int, int> last;
    const bool refused = std::any_of(model.pairs.begin(), model.pairs.end(), [&](const BodyPair& pair) {
      const Body &a = model.bodies[pair.first], &b = model.bodies[pair.second];
      const double far = a.shape.extent() + b.shape.extent();
      if ((placed[pair.first].p - placed[pair.second].p).squaredNorm() > far * far) return false;
      if (!(distance(a.shape, placed[pair.first], b.shape, placed[pair.second]) < 0.0)) return false;
      last = {a.link, b.link};
      return true;
    });
    // What the bodies call free is: they hold the parts. Unless a pair was left out, so a tenth is looked at.
    if (!refused && c % 10 != 0) {
      ++result.free;
      continue;
    }
    if (parts_touch(parts, poses, together)) {
      result.missed += !refused;
    } else {
      ++result.free;
      result.refused += refused;
      if (refused) ++blame[last];
    }
  }
  for (const auto& [links, count] : blame)
    result.blame.push_back({model.link_names[links.first], model.link_names[links.second], count});
  std::stable_sort(result.blame.begin(), result.blame.end(),
                   [](const auto& x, const auto& y) { return x.count > y.count; });
  result.judged = settings.judged;
}

/// A configuration as near to the middle of the limits as some random ones allow, in which the bodies are apart.
bool choose_home(FitResult& result) {
  constexpr double kRoom = 0.01;  // m
  constexpr int kTries = 4000;
  RobotModel& model = result.model;
  const auto room = [&](const JointVector& q) {
    const auto poses = poses_at(model, q);
    double least = std::numeric_limits<double>::infinity();
    for (const BodyPair& pair : model.pairs) {
      const Body &a = model.bodies[pair.first], &b = model.bodies[pair.second];
      const Eigen::Isometry3d A = poses[a.link] * a.origin, B = poses[b.link] * b.origin;
      least = std::min(
          least, distance(a.shape, Placed{A.translation(), A.linear()}, b.shape, Placed{B.translation(), B.linear()}));
    }
    return least;
  };
  if (room(model.home) > kRoom) return true;
  const JointVector middle = model.home;
  const JointBox box(model, 0, model.dof());
  std::mt19937 random(1);
  for (int i = 1; i <= kTries; ++i) {
    JointVector q = middle + (static_cast<double>(i) / kTries) * (box.sample(random) - middle);
    for (int k = 0; k < model.dof(); ++k) q[k] = std::round(q[k] * 1e3) / 1e3;
    if ((q.array() < model.position_min.array()).any() || (q.array() > model.position_max.array()).any()) continue;
    if (room(q) <= kRoom) continue;
    model.home = q;
    result.robot.home = std::vector<double>(q.data(), q.data() + q.size());
    return true;
  }
  return false;
}

}  // namespace

Result<FitResult> fit_bodies(const FitSettings& settings) {
  const auto say = [&](const std::string& what, double fraction) {
    if (settings.progress) settings.progress(what, fraction);
  };
  FitResult result;
  result.robot.urdf = settings.urdf;
  result.robot.tool_link = settings.tip;
  Result<RobotModel> bare = load_robot(result.robot);
  if (!bare) return bare.error();
  result.model = *std::move(bare);
  const Result<UrdfChain> chain = read_urdf_chain(settings.urdf, settings.tip);
  if (!chain) return chain.error();
  std::vector<UnreadElement> unread;
  const Result<urdf::ModelInterfaceSharedPtr> read = read_urdf(settings.urdf, Xacro::kIfNamed, &unread);
  if (!read) return read.error();
  const urdf::ModelInterface& urdf = **read;
  if (Status s = check_unread(urdf, unread, settings); !s) return s.error();
  for (const auto& [name, files] : settings.meshes) {
    if (!urdf.getLink(name)) return Error{fmt::format("{} has no link '{}'", settings.urdf.string(), name)};
  }
  result.robot.name = result.model.name;
  result.robot.tool_link = chain->tool_link;
  result.robot.locked = chain->assumed;

  std::error_code error;
  LinkReader reader(settings, std::filesystem::absolute(settings.urdf, error).parent_path());
  const auto groups = group_links(urdf, *chain, settings, result.left_out);
  std::vector<Surface> surfaces;
  std::vector<std::vector<Solid>> exact;
  for (const auto& group : groups) {
    FittedLink link;
    link.link = group[0]->name;
    link.joined = static_cast<int>(group.size()) - 1;
    say("reading " + link.link, 0.1 * static_cast<double>(surfaces.size()) / static_cast<double>(groups.size()));
    LinkGeometry all;
    for (const urdf::Link* member : group) {
      Result<LinkGeometry> geometry = reader.read(*member);
      if (!geometry) return geometry.error();
      if (geometry->pieces.empty()) continue;
      if (Status s = check_size(settings, *member, *geometry, *chain); !s) return s.error();
      if (all.source.empty()) all.source = geometry->source;
      if (group.size() == 1) all.exact = geometry->exact;
      const Eigen::Affine3d placed(chain->frames.at(link.link).X_link_frame.inverse() *
                                   chain->frames.at(member->name).X_link_frame);
      for (Surface& piece : geometry->pieces)
        all.pieces.push_back(member == group[0] ? std::move(piece) : moved(std::move(piece), placed));
    }
    if (all.pieces.empty()) continue;
    link.source = all.source;
    link.parts = convex_parts(all.pieces, kMostParts, kLeastCut);
    Surface surface;
    for (const Surface& piece : all.pieces) surface.insert(surface.end(), piece.begin(), piece.end());
    link.triangles = surface.size();
    surfaces.push_back(std::move(surface));
    exact.push_back(all.exact);
    result.links.push_back(std::move(link));
  }
  if (result.links.empty()) {
    return Error{fmt::format("{}: no link has collision or visual geometry: there is nothing to fit bodies to",
                             settings.urdf.string())};
  }

  const std::vector<Part> parts = make_parts(result.links, *chain, 80);
  const RowPairs together = links_together(result.model, parts, settings.seed);
  for (const auto& [a, b] : together) result.together.emplace_back(result.links[a].link, result.links[b].link);
  if (!together.empty() && !settings.touching) {
    const auto& [a, b] = result.together.front();
    return Error{
        fmt::format("{}: '{}' and '{}' touch in every configuration{}; --touching keeps nothing between them",
                    settings.urdf.string(), a, b,
                    settings.visual ? "" : ": collision geometry may be coarse, --visual takes what it shows")};
  }
  const std::vector<Poses> free = free_poses(result.model, parts, together, settings.seed,
                                             [&](double f) { say("moving the arm about", 0.1 + 0.05 * f); });
  if (free.empty()) {
    return Error{fmt::format("{}: its links touch each other in every configuration", settings.urdf.string())};
  }
  say("looking for links that never meet", 0.15);
  RowPairs left_out = links_apart(result.model, make_parts(result.links, *chain, 0));
  left_out.insert(together.begin(), together.end());
  const std::size_t rows = result.links.size();
  std::vector<std::vector<Solid>> solids = exact;
  std::vector<std::vector<Fitted>> bodies(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    if (exact[row].empty()) continue;
    for (Solid& solid : solids[row]) solid = rounded(solid);
    prove(surfaces[row], solids[row]);
    bodies[row] = cores_of(solids[row], row, chain->frames.at(result.links[row].link));
  }
  int least = std::numeric_limits<int>::max();
  for (int round = 0; round <= settings.rounds; ++round) {
    std::vector<std::vector<Fitted>> begun(rows);
    for (std::size_t row = 0; row < rows; ++row) {
      if (!exact[row].empty()) continue;
      const FittedLink& link = result.links[row];
      const UrdfChain::Frame& frame = chain->frames.at(link.link);
      std::vector<Probe> probes =
          probes_of(row, parts, round == 0 ? begun : bodies, free, left_out, frame, settings.seed);
      add_probes_around(link.parts, settings.seed, probes);
      CoverSettings cover_settings;
      cover_settings.most = settings.most;
      cover_settings.boxes = settings.boxes;
      cover_settings.price = kPrice;
      cover_settings.box_price = kBoxPrice;
      cover_settings.squarings = std::min(round, 2);
      cover_settings.seed = settings.seed + static_cast<std::uint32_t>(round);
      cover_settings.progress = [&](double fraction) {
        const double done = (static_cast<double>(row) + fraction) / static_cast<double>(rows);
        say("fitting " + link.link, 0.15 + 0.6 * (round + done) / (settings.rounds + 1));
      };
      Cover found = cover(searched(surfaces[row], link.parts), probes, cover_settings, solids[row]);
      if (surfaces[row].size() > kMostSearched) prove(surfaces[row], found.solids);
      const std::vector<Fitted> before = bodies[row];
      bodies[row] = cores_of(found.solids, row, frame);
      const int refused = round == 0 ? 0 : count_refused(bodies, free, left_out);
      if (round > 0 && refused > least) {
        bodies[row] = before;
        continue;
      }
      least = refused;
      solids[row] = found.solids;
    }
    if (round == 0) least = count_refused(bodies, free, left_out);
  }
  std::vector<std::size_t> row_of_body;
  for (std::size_t row = 0; row < rows; ++row) {
    FittedLink& link = result.links[row];
    measure(surfaces[row], solids[row], link);
    row_of_body.insert(row_of_body.end(), solids[row].size(), row);
    for (std::size_t i = 0; i < solids[row].size(); ++i) {
      const ShapeKind kind = solids[row][i].shape.kind;
      ++(kind == ShapeKind::kSphere ? link.spheres : kind == ShapeKind::kCapsule ? link.capsules : link.boxes);
      result.robot.bodies.push_back(
          {fmt::format("{}_{}", link.link, i), link.link, solids[row][i].shape, solids[row][i].origin});
    }
  }

  say("pairs", 0.75);
  for (const RobotSettings::BodyOnLink& body : result.robot.bodies) {
    const UrdfChain::Frame& frame = chain->frames.at(body.link);
    result.model.bodies.push_back({body.name, frame.link, body.shape, frame.X_link_frame * body.origin});
  }
  for (const Body& a : result.model.bodies) {
    for (const Body& b : result.model.bodies) result.candidates += b.link >= a.link + 2;
  }
  const auto rows_of = [&](const BodyPair& pair) {
    return std::pair(row_of_body[pair.first], row_of_body[pair.second]);
  };
  std::vector<BodyPair> parting = default_pairs(result.model);
  std::erase_if(parting, [&](const BodyPair& pair) { return together.contains(rows_of(pair)); });
  result.always = result.candidates - static_cast<int>(parting.size());
  result.model.pairs = pairs_that_meet(result.model, parting, kMargin);
  std::erase_if(result.model.pairs, [&](const BodyPair& pair) { return left_out.contains(rows_of(pair)); });
  result.never = static_cast<int>(parting.size() - result.model.pairs.size());
  if (result.never > 0 || !together.empty()) {
    result.robot.pairs.emplace();
    for (const auto& [a, b] : result.model.pairs) {
      result.robot.pairs->emplace_back(result.model.bodies[a].name, result.model.bodies[b].name);
    }
  }
  if (!choose_home(result)) {
    return Error{
        fmt::format("{}: no configuration was found in which the arm does not touch itself{}", settings.urdf.string(),
                    settings.visual ? "" : "; its collision geometry may be coarse: --visual takes what it shows")};
  }
  if (settings.judged > 0) judge(*chain, settings, together, result);
  say("done", 1.0);
  return result;
}

}  // namespace steadyhand
