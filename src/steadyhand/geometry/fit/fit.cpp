#include "steadyhand/geometry/fit/fit.hpp"

#include <fmt/format.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "steadyhand/geometry/fit/free_space.hpp"
#include "steadyhand/geometry/fit/link_geometry.hpp"
#include "steadyhand/geometry/robot/joint_search.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/geometry/robot/pairs.hpp"
#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

constexpr double kPrice = 2e-4;      // share of free space that a body must be worth
constexpr double kBoxPrice = 2e-4;   // and a box, whose distances take longer
constexpr double kMargin = 0.02;     // m; pairs that cannot come so near are left out
constexpr double kLeastCut = 0.004;  // share of the volume that a cut into convex parts must remove at least
constexpr int kMostParts = 10;
constexpr std::size_t kMostSearched = 60'000;  // triangles of a link in the search

/// The surface that the search for a cover uses: the triangles, or, if they are too many, the convex parts. The parts
/// are a little smaller (prove() uses the triangles).
Surface searched(const Surface& surface, const std::vector<Hull>& parts) {
  if (surface.size() <= kMostSearched) return surface;
  Surface faces;
  for (const Hull& part : parts) faces.insert(faces.end(), part.faces.begin(), part.faces.end());
  return faces;
}

bool inside(const Hull& hull, const Vector3& p) {
  return std::all_of(hull.faces.begin(), hull.faces.end(),
                     [&](const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]).dot(p - t[0]) <= 0.0; });
}

/// Volumes by even sampling of the box about all.
void measure(const Surface& surface, const std::vector<FittedSolid>& solids, FittedLink& link) {
  constexpr int kSamples = 40;  // along each axis
  Points corners;
  for (const Triangle& t : surface) corners.insert(corners.end(), t.begin(), t.end());
  link.hull = convex_hull(corners).volume;
  Vector3 low = Vector3::Constant(1e9), high = -low;
  for (const FittedSolid& solid : solids) {
    low = low.cwiseMin(solid.origin.translation() - Vector3::Constant(solid.shape.extent()));
    high = high.cwiseMax(solid.origin.translation() + Vector3::Constant(solid.shape.extent()));
  }
  int covered = 0, filled = 0;
  for (int i = 0; i < kSamples * kSamples * kSamples; ++i) {
    const Vector3 share((i % kSamples + 0.5) / kSamples, (i / kSamples % kSamples + 0.5) / kSamples,
                        (i / kSamples / kSamples + 0.5) / kSamples);
    const Vector3 p = low + share.cwiseProduct(high - low);
    if (std::none_of(solids.begin(), solids.end(), [&](const FittedSolid& s) { return s.distance(p) <= 0.0; }))
      continue;
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
  const JointBox box(model);
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
    // The bodies contain the parts, so a configuration without contact of bodies is free. A pair that was left out
    // could break this, so every tenth such configuration is checked.
    if (!refused && c % 10 != 0) {
      ++result.free;
      continue;
    }
    if (parts_touch(model, parts, poses, together)) {
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
  const JointBox box(model);
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

/// The steps of fit_bodies(), and what each leaves for the next.
class Fitter {
 public:
  explicit Fitter(const FitSettings& settings) : settings_(settings) {}

  Result<FitResult> fit() {
    if (Status s = read_robot(); !s) return s.error();
    if (Status s = find_free(); !s) return s.error();
    cover_links();
    take_bodies();
    say("pairs", 0.75);
    choose_pairs();
    if (!choose_home(result_)) {
      return Error{
          fmt::format("{}: no configuration was found in which the arm does not touch itself{}", file(),
                      settings_.visual ? "" : "; its collision geometry may be coarse: --visual uses visual geometry")};
    }
    if (settings_.judged > 0) judge(*chain_, settings_, together_, result_);
    say("done", 1.0);
    return std::move(result_);
  }

 private:
  /// What is known of a row of FitResult::links.
  struct Row {
    Surface surface;
    bool exact = false;  ///< the URDF says what its solids are
    std::vector<FittedSolid> solids;
  };

  std::string file() const { return settings_.urdf.string(); }
  void say(const std::string& what, double fraction) const {
    if (settings_.progress) settings_.progress(what, fraction);
  }
  const UrdfChain::Frame& frame(const std::string& link) const { return chain_->frames.at(link); }

  Status read_robot() {
    result_.robot.urdf = settings_.urdf;
    result_.robot.tools = tools_on(settings_.tip);
    Result<RobotModel> bare = load_robot(result_.robot);
    if (!bare) return bare.error();
    result_.model = *std::move(bare);
    Result<UrdfChain> chain = read_urdf_chain(settings_.urdf, links_of(result_.robot.tools));
    if (!chain) return chain.error();
    chain_ = *std::move(chain);
    std::vector<UnreadElement> unread;
    const Result<urdf::ModelInterfaceSharedPtr> read = read_urdf(settings_.urdf, Xacro::kIfNamed, &unread);
    if (!read) return read.error();
    if (Status s = check_unread(**read, unread, settings_); !s) return s.error();
    for (const auto& [name, files] : settings_.meshes) {
      if (!(*read)->getLink(name)) return Error{fmt::format("{} has no link '{}'", file(), name)};
    }
    result_.robot.name = result_.model.name;
    for (std::size_t i = 0; i < chain_->tool_links.size(); ++i) result_.robot.tools[i].link = chain_->tool_links[i];
    result_.robot.locked = chain_->assumed;
    return read_links(**read);
  }

  Status read_links(const urdf::ModelInterface& urdf) {
    std::error_code error;
    LinkReader reader(settings_, std::filesystem::absolute(settings_.urdf, error).parent_path());
    const auto groups = group_links(urdf, *chain_, settings_, result_.left_out);
    for (const auto& group : groups) {
      FittedLink link;
      link.link = group[0]->name;
      link.joined = static_cast<int>(group.size()) - 1;
      say("reading " + link.link, 0.1 * static_cast<double>(rows_.size()) / static_cast<double>(groups.size()));
      const Result<LinkGeometry> all = read_group(reader, group);
      if (!all) return all.error();
      if (all->pieces.empty()) continue;
      link.source = all->source;
      link.parts = convex_parts(all->pieces, kMostParts, kLeastCut);
      Row row{{}, !all->exact.empty(), all->exact};
      for (const Surface& piece : all->pieces) row.surface.insert(row.surface.end(), piece.begin(), piece.end());
      link.triangles = row.surface.size();
      rows_.push_back(std::move(row));
      result_.links.push_back(std::move(link));
    }
    if (!rows_.empty()) return Done{};
    return Error{
        fmt::format("{}: no link has collision or visual geometry: there is nothing to fit bodies to", file())};
  }

  /// The geometry of links that are covered together, in the frame of the first.
  Result<LinkGeometry> read_group(LinkReader& reader, const std::vector<const urdf::Link*>& group) const {
    LinkGeometry all;
    for (const urdf::Link* member : group) {
      Result<LinkGeometry> geometry = reader.read(*member);
      if (!geometry) return geometry.error();
      if (geometry->pieces.empty()) continue;
      if (Status s = check_size(settings_, *member, *geometry, *chain_); !s) return s.error();
      if (all.source.empty()) all.source = geometry->source;
      if (group.size() == 1) all.exact = geometry->exact;
      const Eigen::Affine3d placed(frame(group[0]->name).X_link_frame.inverse() * frame(member->name).X_link_frame);
      for (Surface& piece : geometry->pieces)
        all.pieces.push_back(member == group[0] ? std::move(piece) : moved(std::move(piece), placed));
    }
    return all;
  }

  /// Configurations in which the arm does not touch itself, and the links that always do or never can.
  Status find_free() {
    parts_ = make_parts(result_.links, *chain_, 80);
    together_ = links_together(result_.model, parts_, settings_.seed);
    for (const auto& [a, b] : together_) result_.together.emplace_back(result_.links[a].link, result_.links[b].link);
    if (!together_.empty() && !settings_.touching) {
      const auto& [a, b] = result_.together.front();
      return Error{
          fmt::format("{}: '{}' and '{}' touch in every configuration{}; --touching accepts that", file(), a, b,
                      settings_.visual ? "" : ": collision geometry may be coarse, --visual uses visual geometry")};
    }
    free_ = free_poses(result_.model, parts_, together_, settings_.seed,
                       [&](double f) { say("moving the arm about", 0.1 + 0.05 * f); });
    if (free_.empty()) return Error{fmt::format("{}: its links touch each other in every configuration", file())};
    say("looking for links that never meet", 0.15);
    left_out_ = links_apart(result_.model, make_parts(result_.links, *chain_, 0));
    left_out_.insert(together_.begin(), together_.end());
    return Done{};
  }

  /// Each link on its own, then again to the bodies of the others, as long as that frees more.
  void cover_links() {
    bodies_.resize(rows_.size());
    const auto take = [this](std::size_t row) {
      return cores_of(rows_[row].solids, row, frame(result_.links[row].link));
    };
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      if (!rows_[row].exact) continue;
      for (FittedSolid& solid : rows_[row].solids) solid = rounded(solid);
      prove(rows_[row].surface, rows_[row].solids);
      bodies_[row] = take(row);
    }
    int least = 0;
    for (int round = 0; round <= settings_.rounds; ++round) {
      for (std::size_t row = 0; row < rows_.size(); ++row) {
        if (rows_[row].exact) continue;
        Cover found = cover_of(row, round);
        std::swap(rows_[row].solids, found.solids);
        std::vector<Fitted> bodies = take(row);
        std::swap(bodies_[row], bodies);
        if (round == 0) continue;
        const int refused = count_refused(result_.model, bodies_, free_, left_out_);
        if (refused <= least) {
          least = refused;
        } else {
          rows_[row].solids = std::move(found.solids);
          bodies_[row] = std::move(bodies);
        }
      }
      if (round == 0) least = count_refused(result_.model, bodies_, free_, left_out_);
    }
  }

  Cover cover_of(std::size_t row, int round) const {
    const FittedLink& link = result_.links[row];
    const Surface& surface = rows_[row].surface;
    std::vector<CoverProbe> probes =
        probes_of(result_.model, row, parts_, round == 0 ? std::vector<std::vector<Fitted>>(rows_.size()) : bodies_,
                  free_, left_out_, frame(link.link), settings_.seed);
    add_probes_around(link.parts, settings_.seed, probes);
    CoverSettings cover_settings;
    cover_settings.most = settings_.most;
    cover_settings.boxes = settings_.boxes;
    cover_settings.price = kPrice;
    cover_settings.box_price = kBoxPrice;
    cover_settings.squarings = std::min(round, 2);
    cover_settings.seed = settings_.seed + static_cast<std::uint32_t>(round);
    cover_settings.progress = [&](double fraction) {
      const double done = (static_cast<double>(row) + fraction) / static_cast<double>(rows_.size());
      say("fitting " + link.link, 0.15 + 0.6 * (round + done) / (settings_.rounds + 1));
    };
    Cover found = cover(searched(surface, link.parts), probes, cover_settings, rows_[row].solids);
    if (surface.size() > kMostSearched) prove(surface, found.solids);
    return found;
  }

  /// The bodies of the robot file and of the model.
  void take_bodies() {
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      FittedLink& link = result_.links[row];
      const std::vector<FittedSolid>& solids = rows_[row].solids;
      measure(rows_[row].surface, solids, link);
      for (std::size_t i = 0; i < solids.size(); ++i) {
        const ShapeKind kind = solids[i].shape.kind;
        ++(kind == ShapeKind::kSphere ? link.spheres : kind == ShapeKind::kCapsule ? link.capsules : link.boxes);
        std::string name = fmt::format("{}_{}", link.link, i);
        result_.robot.bodies.push_back({name, link.link, solids[i].shape, solids[i].origin});
        const UrdfChain::Frame& in = frame(link.link);
        result_.model.bodies.push_back({name, in.link, solids[i].shape, in.X_link_frame * solids[i].origin});
      }
    }
  }

  /// The pairs that are kept apart; the robot file has them where they are not all.
  void choose_pairs() {
    std::vector<std::size_t> row_of_body;
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      row_of_body.insert(row_of_body.end(), rows_[row].solids.size(), row);
    }
    const auto erase_rows = [&](std::vector<BodyPair>& pairs, const RowPairs& rows) {
      std::erase_if(pairs, [&](const BodyPair& pair) {
        return rows.contains({row_of_body[pair.first], row_of_body[pair.second]});
      });
    };
    for (const Body& a : result_.model.bodies) {
      for (const Body& b : result_.model.bodies) result_.candidates += may_be_pair(result_.model, a.link, b.link);
    }
    std::vector<BodyPair> parting = default_pairs(result_.model);
    erase_rows(parting, together_);
    result_.always = result_.candidates - static_cast<int>(parting.size());
    result_.model.pairs = pairs_that_meet(result_.model, parting, kMargin);
    erase_rows(result_.model.pairs, left_out_);
    result_.never = static_cast<int>(parting.size() - result_.model.pairs.size());
    if (result_.never == 0 && together_.empty()) return;
    result_.robot.pairs.emplace();
    for (const auto& [a, b] : result_.model.pairs) {
      result_.robot.pairs->emplace_back(result_.model.bodies[a].name, result_.model.bodies[b].name);
    }
  }

  const FitSettings& settings_;
  FitResult result_;
  std::optional<UrdfChain> chain_;
  std::vector<Row> rows_;
  std::vector<std::vector<Fitted>> bodies_;  ///< by row
  std::vector<Part> parts_;
  std::vector<Poses> free_;
  RowPairs together_, left_out_;  ///< rows that cannot be kept apart; that need not be
};

}  // namespace

Result<FitResult> fit_bodies(const FitSettings& settings) { return Fitter(settings).fit(); }

}  // namespace steadyhand
