#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "steadyhand/geometry/fit/cover.hpp"
#include "steadyhand/geometry/fit/fit.hpp"
#include "steadyhand/geometry/fit/free_space.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

/// A word of YAML, in quotation marks unless it is a plain name.
std::string word(const std::string& text) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./";
  const bool plain = !text.empty() && text.find_first_not_of(kPlain) == std::string::npos &&
                     text.find_first_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ") == 0;
  if (plain) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string share_of(int part, int whole) { return whole > 0 ? fmt::format("{:.2f} %", 100.0 * part / whole) : "none"; }

/// What has no bodies, and what shares some.
std::string exceptions(const FitResult& result) {
  std::string text;
  for (const FittedLink& link : result.links) {
    if (link.joined > 0)
      text += fmt::format("\n{} is covered together with {} links behind its locked joints", link.link, link.joined);
  }
  for (const auto& [first, second] : result.together)
    text += fmt::format("\n{} and {} touch in every configuration: no distance is kept between them", first, second);
  if (!result.left_out.empty()) {
    text += fmt::format("\n{} links have no bodies, because joints outside the chain move them: {}{}",
                        result.left_out.size(), result.left_out[0], result.left_out.size() > 1 ? ", ..." : "");
  }
  return text;
}

std::string costs(const FitResult& result) {
  std::string text =
      fmt::format("{} bodies, {} pairs ({} that always overlap and {} that never come near are left out)",
                  result.model.bodies.size(), result.model.pairs.size(), result.always, result.never) +
      exceptions(result);
  if (result.judged == 0) return text;
  text += fmt::format(
      "\nof {} random configurations {} are free by the meshes' convex parts; of these the bodies refuse {}",
      result.judged, share_of(result.free, result.judged), share_of(result.refused, result.free));
  for (std::size_t i = 0; i < std::min<std::size_t>(result.blame.size(), 3); ++i) {
    const FitResult::Blame& blame = result.blame[i];
    text += fmt::format("{} {} between {} and {}",
                        i == 0   ? ","
                        : i == 1 ? ";"
                                 : ";",
                        share_of(blame.count, result.free), blame.first, blame.second);
  }
  if (result.missed > 0) {
    text += fmt::format("\nof {} looked at, {} were called free though links touch: pairs that always overlap hide it",
                        result.judged / 10, result.missed);
  }
  return text;
}

std::string commented(const std::string& text) {
  std::string lines = "# ";
  for (const char c : text) lines += c == '\n' ? std::string("\n# ") : std::string(1, c);
  return lines + "\n";
}

struct Outline {
  std::vector<Eigen::Vector2d> points;
};

/// A view along one axis: right and up in the picture.
struct View {
  const char* name;
  Vector3 right, up;
};

Outline outline_of(const Body& body, const Eigen::Isometry3d& pose, const View& view) {
  constexpr int kDirections = 96;
  const Eigen::Isometry3d X = pose * body.origin;
  Outline outline;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * M_PI * i / kDirections;
    const Vector3 u = std::cos(angle) * view.right + std::sin(angle) * view.up;
    const Vector3 local = X.linear().transpose() * u;
    const Vector3 corner = local.cwiseSign().cwiseProduct(body.shape.core);
    const Vector3 p = X * corner + body.shape.radius * u;
    outline.points.emplace_back(p.dot(view.right), p.dot(view.up));
  }
  return outline;
}

Outline outline_of(const Hull& hull, const Eigen::Isometry3d& pose, const View& view) {
  std::vector<Eigen::Vector2d> points;
  for (const Vector3& corner : hull.corners) {
    const Vector3 p = pose * corner;
    points.emplace_back(p.dot(view.right), p.dot(view.up));
  }
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); });
  const auto chain = [&](auto begin, auto end) {
    std::vector<Eigen::Vector2d> half;
    for (auto p = begin; p != end; ++p) {
      while (half.size() > 1) {
        const Eigen::Vector2d a = half.back() - half[half.size() - 2], b = *p - half.back();
        if (a.x() * b.y() - a.y() * b.x() > 0.0) break;
        half.pop_back();
      }
      half.push_back(*p);
    }
    half.pop_back();
    return half;
  };
  if (points.size() < 3) return {points};
  Outline outline{chain(points.begin(), points.end())};
  const auto back = chain(points.rbegin(), points.rend());
  outline.points.insert(outline.points.end(), back.begin(), back.end());
  return outline;
}

}  // namespace

std::string robot_file(const FitResult& result, const std::string& command, const fs::path& folder) {
  const RobotSettings& robot = result.robot;
  std::error_code error;
  const fs::path urdf = fs::relative(robot.urdf, folder.empty() ? fs::path(".") : folder, error);
  std::string text = commented(fmt::format("{}, its bodies fitted by: {}\nLengths in m, angles in rad.\n{}", robot.name,
                                           command, costs(result)));
  text += fmt::format("\nname: {}\nurdf: {}\n", word(robot.name),
                      word(error || urdf.empty() ? robot.urdf.string() : urdf.string()));
  const bool several = robot.tools.size() > 1;
  text += several ? "\ntools:\n" : "\ntool:\n";
  for (const RobotSettings::ToolOnLink& tool : robot.tools) {
    const char* indent = several ? "    " : "  ";
    if (several) text += fmt::format("  {}:\n", word(tool.name));
    text += fmt::format("{0}link: {1}\n{0}xyz: [0.0, 0.0, 0.0]\n{0}rpy: [0.0, 0.0, 0.0]\n", indent, word(tool.link));
  }
  if (!robot.locked.empty()) {
    text += "\n# Moving joints outside the chain: set their positions.\nlocked:\n";
    for (const auto& [joint, value] : robot.locked) text += fmt::format("  {}: {:.6g}\n", word(joint), value);
  }
  if (const auto* home = robot.home ? std::get_if<std::vector<double>>(&*robot.home) : nullptr) {
    text += "\n# The middle of the limits would touch itself.\nhome: [";
    for (std::size_t k = 0; k < home->size(); ++k) text += fmt::format("{}{:.3f}", k > 0 ? ", " : "", (*home)[k]);
    text += "]\n";
  }
  text += "\nbodies:\n";
  for (const RobotSettings::BodyOnLink& body : robot.bodies) {
    text += fmt::format("  - {{name: {}, link: {}, {}}}\n", word(body.name), word(body.link),
                        as_written({body.shape, body.origin}));
  }
  if (!robot.pairs) return text + "\npairs: auto\n";
  text += "\n# auto without those that cannot come near each other\npairs:\n";
  for (const auto& [a, b] : *robot.pairs) text += fmt::format("  - [{}, {}]\n", word(a), word(b));
  return text;
}

std::string fit_table(const FitResult& result) {
  std::size_t width = 4;
  for (const FittedLink& link : result.links) width = std::max(width, link.link.size());
  std::string text = fmt::format("{:<{}}  {:<9} {:>9}  {:>7} {:>8} {:>5}  {:>14} {:>15}\n", "link", width, "geometry",
                                 "triangles", "spheres", "capsules", "boxes", "cover/hull", "cover/parts");
  for (const FittedLink& link : result.links) {
    text +=
        fmt::format("{:<{}}  {:<9} {:>9}  {:>7} {:>8} {:>5}  {:>14.2f} {:>15.2f}\n", link.link, width, link.source,
                    link.triangles, link.spheres, link.capsules, link.boxes,
                    link.hull > 0.0 ? link.cover / link.hull : 0.0, link.solid > 0.0 ? link.cover / link.solid : 0.0);
  }
  return text + costs(result) + "\n";
}

std::string fit_picture(const FitResult& result) {
  const RobotModel& model = result.model;
  const View views[] = {{"front (from x)", Vector3::UnitY(), Vector3::UnitZ()},
                        {"side (from -y)", Vector3::UnitX(), Vector3::UnitZ()},
                        {"top", Vector3::UnitX(), Vector3::UnitY()}};
  constexpr double kScale = 600.0, kBorder = 30.0;  // pixels per m, pixels
  constexpr const char* kColors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9",
                                     "#e69f00", "#4d4d4d", "#8c6d00", "#332288"};
  const Poses poses = poses_at(model, model.home);
  std::string drawn;
  double x = kBorder, height = 0.0;
  for (const View& view : views) {
    std::vector<std::pair<Outline, std::string>> outlines;
    for (const FittedLink& link : result.links) {
      // A body of the link says where the link's frame is.
      const auto body = std::find_if(result.robot.bodies.begin(), result.robot.bodies.end(),
                                     [&](const auto& b) { return b.link == link.link; });
      if (body == result.robot.bodies.end()) continue;
      const Body& placed = model.bodies[static_cast<std::size_t>(body - result.robot.bodies.begin())];
      const Eigen::Isometry3d pose = poses[placed.link] * placed.origin * body->origin.inverse();
      for (const Hull& part : link.parts)
        outlines.push_back({outline_of(part, pose, view), "fill=\"#bbb\" stroke=\"#888\" stroke-width=\"0.5\""});
    }
    for (const Body& body : model.bodies) {
      const char* color = kColors[body.link % std::size(kColors)];
      outlines.push_back(
          {outline_of(body, poses[body.link], view),
           fmt::format("fill=\"{}\" fill-opacity=\"0.12\" stroke=\"{}\" stroke-width=\"1.2\"", color, color)});
    }
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
    for (const auto& [outline, style] : outlines) {
      for (const Eigen::Vector2d& p : outline.points) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
    }
    drawn += fmt::format("<text x=\"{:.0f}\" y=\"18\">{}</text>\n", x, view.name);
    for (const auto& [outline, style] : outlines) {
      drawn += "<polygon points=\"";
      for (const Eigen::Vector2d& p : outline.points) {
        drawn += fmt::format("{:.1f},{:.1f} ", x + kScale * (p.x() - low.x()), kBorder + kScale * (high.y() - p.y()));
      }
      drawn += "\" " + style + "/>\n";
    }
    height = std::max(height, kScale * (high.y() - low.y()));
    x += kScale * (high.x() - low.x()) + kBorder;
  }
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" font-family=\"sans-serif\" "
      "font-size=\"14\"><rect width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"#fff\"/>\n{2}</svg>\n",
      x, height + 2.0 * kBorder, drawn);
}

}  // namespace steadyhand
