#include "steadyhand/files/record/problem_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>

#include "steadyhand/files/record/document_style.hpp"

namespace steadyhand {

/// What a tool carries.
struct CarriedNote {
  SolidNote solid{};
  int tool = 0;
};
/// The index of a body of the arm, or (from kMaxBodies on) what a tool carries.
struct MovedNote {
  int body = 0;
  CarriedNote carried{};
};

struct ProblemStyle : DocumentStyle {
  using DocumentStyle::read, DocumentStyle::write;

  static void write(JsonWriter& json, const MovedNote& moved, const Limits&) {
    moved.body < kMaxBodies ? json.value(moved.body) : json.raw(document(moved.carried));
  }
  template <typename In, typename Json>
  static void read(In& in, const Json& json, MovedNote& moved, const Limits&, std::string_view name) {
    if (json.is_number_integer() && json >= 0 && json < kMaxBodies) {
      moved.body = json.template get<int>();
    } else if (json.is_object()) {
      moved.body = kMaxBodies;
      JsonIn<Json, ProblemStyle> inner(json, true);
      inner.members(moved.carried);
      if (inner.error()) in.fail(fmt::format("'{}': {}", name, inner.error()->message));
    } else {
      in.must(name, "the index of a body, or what a tool carries", json);
    }
  }
  /// Weights of a term; one of them also without brackets.
  static void write(JsonWriter& json, const std::vector<double>& weights, const Limits& limits) {
    if (weights.size() == 1) return write(json, weights[0], limits);
    write(json, Eigen::VectorXd::Map(weights.data(), std::ssize(weights)), limits);
  }
  template <typename In, typename Json>
  static void read(In& in, const Json& json, std::vector<double>& weights, const Limits&, std::string_view name) {
    const auto is_number = [](const Json& entry) { return entry.is_number(); };
    if (!json.is_number() && !(json.is_array() && std::all_of(json.begin(), json.end(), is_number))) {
      return in.must(name, "a number, or a list of numbers", json);
    }
    weights = json.is_number() ? std::vector{json.template get<double>()} : json.template get<std::vector<double>>();
  }
};

template <typename V>
constexpr bool kWrites = requires(V& v) { v.json(); };

struct NodeNote {
  Vector3 p;
  std::array<Vector3, 3> R;  ///< its rows
};
static NodeNote note_of(const Vector3& p, const Matrix3& R) {
  return {p, {R.row(0).transpose(), R.row(1).transpose(), R.row(2).transpose()}};
}
static Matrix3 rotation_of(const NodeNote& node) {
  return (Matrix3() << node.R[0].transpose(), node.R[1].transpose(), node.R[2].transpose()).finished();
}
template <typename V>
void describe(V& v, NodeNote& node) {
  v.add("p", "m", "", node.p);
  v.add("R", "", "", node.R);
  if constexpr (kReads<V>) {
    const Matrix3 R = rotation_of(node);
    v.check((R * R.transpose() - Matrix3::Identity()).norm() <= 1e-6 && R.determinant() > 0.0,
            "'R' is no rotation matrix: its rows must be orthonormal, its determinant 1");
  }
}

template <typename V>
void describe(V& v, Trajectory& guess) {
  v.add("x", "", "", guess.x);
  v.add("u", "", "", guess.u);
}

template <typename V>
void describe_tool(V& v, int& tool) {
  if (!kWrites<V> || tool > 0) v.add("tool", "", "", tool, within(0, kMaxTools - 1).or_absent());
}
template <typename V>
void describe(V& v, CarriedNote& carried) {
  describe(v, carried.solid);
  describe_tool(v, carried.tool);
}

static SolidNote note_of(const Obstacle& obstacle) {
  return {obstacle.shape, Eigen::Translation3d(obstacle.at.p) * Eigen::Isometry3d(Eigen::Quaterniond(obstacle.at.R))};
}
static void take(const SolidNote& solid, Obstacle& obstacle) {
  obstacle.shape = solid.shape;
  obstacle.at = {solid.origin.translation(), solid.origin.linear()};
}
template <typename V>
void describe(V& v, NearObstacle& near) {
  MovedNote moved{near.body};
  SolidNote solid;
  if constexpr (kWrites<V>) {  // poses that were never set are not read
    if (near.body >= kMaxBodies) moved.carried = {note_of(near.carried), near.carried.tool};
    solid = note_of(near.obstacle);
  }
  v.add("body", "", "", moved);
  describe(v, solid);
  if (!kWrites<V> || near.obstacle.carried) v.add("carried", "", "", near.obstacle.carried, kOrAbsent);
  describe_tool(v, near.obstacle.tool);
  v.add("velocity", "m/s", "", near.obstacle.velocity, kOrAbsent);
  v.add("depth", "m", "", near.depth, at_least(0.0).or_absent());
  if (!kWrites<V> || near.corner >= 0) v.add("corner", "", "", near.corner, within(-1, 7).or_absent());
  if constexpr (kReads<V>) {
    near.body = moved.body;
    take(solid, near.obstacle);
    if (moved.body == kMaxBodies) take(moved.carried.solid, near.carried);
    near.carried.tool = moved.carried.tool;
  }
}

template <typename V>
void describe(V& v, LiquidRecord& liquid) {
  GlassSettings& glass = liquid.settings.glass;
  v.add("radius", "m", "", glass.radius);
  v.add("height", "m", "", glass.height);
  v.add("fill", "m", "", glass.fill);
  v.add("viscosity", "m^2/s", "", glass.viscosity);
  v.add("frequency_factor", "", "", glass.frequency_factor);
  v.add("price", "1/m", "", liquid.settings.price);
  v.add("least_weight", "g", "", liquid.settings.least_weight);
  v.add("lean", "rad", "", liquid.settings.lean_max);
  v.add("room", "m", "", liquid.room);
  v.add("frequencies", "", "", liquid.settings.frequencies);
  v.add("counts", "", "", liquid.counts, kOrAbsent);
  v.add("state", "", "", liquid.state);
}

/// A tool's part of a problem.
struct ToolNote {
  std::vector<NodeNote> reference;
  std::optional<LiquidRecord> liquid;
};
template <typename V>
void describe(V& v, ToolNote& tool) {
  v.add("reference", "", "", tool.reference);
  v.add("liquid", "", "", tool.liquid);
}

static std::vector<ToolNote> tools_of(const ProblemRecord& problem) {
  std::vector<ToolNote> tools(problem.tools);
  for (std::size_t t = 0; t < tools.size(); ++t) {
    for (int k = 0; k < problem.horizon; ++k)
      tools[t].reference.push_back(note_of(problem.reference.tools[t].p[k], problem.reference.tools[t].R[k]));
    if (t < problem.liquid.size()) tools[t].liquid = problem.liquid[t];
  }
  return tools;
}

static void take(const std::vector<ToolNote>& tools, ProblemRecord& problem) {
  problem.tools = static_cast<int>(tools.size());
  problem.reference.nodes = problem.horizon;
  problem.reference.dt = problem.dt;
  problem.liquid.clear();
  for (std::size_t t = 0; t < tools.size(); ++t) {
    ToolReference& reference = problem.reference.tools[t];
    for (int k = 0; k < problem.horizon; ++k) {
      reference.p[k] = tools[t].reference[k].p;
      reference.R[k] = rotation_of(tools[t].reference[k]);
    }
    if (tools[t].liquid) problem.liquid.push_back(*tools[t].liquid);
  }
}

/// Why the tools' parts do not fit into one problem, or nothing.
static std::string fault_of(const std::vector<ToolNote>& tools, int horizon) {
  for (std::size_t t = 0; t < tools.size(); ++t) {
    if (std::ssize(tools[t].reference) != horizon)
      return fmt::format("'tools[{}].reference' has {} entries; it must have {}", t, tools[t].reference.size(),
                         horizon);
    if (tools[t].liquid.has_value() != tools[0].liquid.has_value())
      return fmt::format("'tools[{}].liquid' must be there for each tool, or for none", t);
    if (!tools[t].liquid) continue;
    LiquidSettings settings = tools[t].liquid->settings;
    settings.glass = tools[0].liquid->settings.glass;
    if (settings != tools[0].liquid->settings)
      return fmt::format("'tools[{}].liquid' must have price, least_weight, lean and frequencies of the first tool's",
                         t);
  }
  return "";
}

template <typename V>
void describe_given(V& v, JointSet& given, std::size_t joints) {
  std::vector<int> list;
  for (int j = 0; j < kMaxJoints; ++j)
    if (given[j]) list.push_back(j);
  if (!kWrites<V> || !list.empty())
    v.add("given", "", "", list, within(0, static_cast<double>(joints) - 1.0).sized(0, joints).or_absent());
  if constexpr (kReads<V>) {
    for (std::size_t i = 0; i < list.size() && !v.error(); ++i) {
      v.check(!given[list[i]], fmt::format("'given' has joint {} twice", list[i]));
      given.set(list[i]);
    }
  }
}

template <typename V>
void describe(V& v, ProblemRecord& problem) {
  v.add("robot", "", "", problem.robot);
  v.add("dt", "s", "", problem.dt, above(0.0));
  v.add("horizon", "", "", problem.horizon, within(1, kMaxHorizon));
  v.add("x0", "", "", problem.x0, sized(2, 2 * kMaxJoints));
  v.check(problem.x0.size() % 2 == 0, fmt::format("'x0' has {} entries; it must have 2n for n joints, n from 1 to {}",
                                                  problem.x0.size(), kMaxJoints));
  v.add("weights", "", "", problem.weights);
  const auto horizon = static_cast<std::size_t>(problem.horizon);
  const auto joints = static_cast<std::size_t>(problem.x0.size() / 2);
  // One tool's part is the problem's own; those of several are a list.
  std::vector<ToolNote> tools, several;
  if constexpr (kWrites<V>) tools = tools_of(problem);
  ToolNote only = tools.size() == 1 ? tools[0] : ToolNote{};
  if (tools.size() > 1) several = tools;
  if (!kWrites<V> || several.empty()) v.add("reference", "", "", only.reference, sized(horizon, horizon).or_absent());
  if (!kWrites<V> || !several.empty()) v.add("tools", "", "", several, sized(2, kMaxTools).or_absent());
  v.add("tolerance", "", "", problem.tolerance, above(0.0).or_absent());
  const auto add_vector = [&](std::string_view name, JointVector& value) {
    std::optional<JointVector> given;
    if (value.size() > 0) given = value;
    v.add(name, "", "", given, sized(joints, joints));
    if (kReads<V> && given) value = *given;
  };
  add_vector("position_margin", problem.position_margin);
  if (!kWrites<V> || !problem.near.empty()) {
    v.add("obstacles", "", "", problem.near, sized(0, kMaxObstacleRows).or_absent());
  }
  add_vector("u_followed", problem.u_followed);
  if (!kWrites<V> || problem.clearance > 0.0) v.add("clearance", "m", "", problem.clearance, kOrAbsent);
  std::optional<NodeNote> held;
  if (problem.held) held = note_of(problem.held->p, problem.held->R);
  v.add("held", "", "", held);
  v.add("liquid", "", "", only.liquid);
  describe_given(v, problem.given, joints);
  v.add("guess", "", "", problem.guess, kWrites<V> ? kOrAbsent : kOrNull.or_absent());
  if constexpr (kReads<V>) {
    v.check(!only.reference.empty() || !several.empty(), "'reference' is missing");
    v.check(several.empty() || (only.reference.empty() && !only.liquid),
            "'reference' and 'liquid' belong into 'tools' where there are several");
    if (several.empty()) several.push_back(only);
    const std::string fault = v.error() ? "" : fault_of(several, problem.horizon);
    v.check(fault.empty(), fault);
    if (v.error()) return;
    take(several, problem);
    if (held) problem.held = {held->p, rotation_of(*held)};
    const auto fits = [](const auto& vectors, std::size_t size, std::size_t each) {
      const auto has = [&](const auto& vector) { return vector.size() == static_cast<Eigen::Index>(each); };
      return vectors.size() == size && std::all_of(vectors.begin(), vectors.end(), has);
    };
    const auto& guess = problem.guess;
    v.check(!guess || (fits(guess->x, horizon + 1, 2 * joints) && fits(guess->u, horizon, joints)),
            fmt::format("'guess' must have {} 'x' of {} entries and {} 'u' of {}", horizon + 1, 2 * joints, horizon,
                        joints));
  }
}

template <typename V>
void describe(V& v, Solution& solution) {
  v.add("status", "", "", to_string(solution.status));
  v.add("objective", "", "", solution.objective);
  v.add("iterations", "", "", solution.iterations);
  v.add("time_us", "us", "", solution.time_us);
  v.add("kkt_error", "", "", solution.kkt_error);
  describe(v, solution.trajectory);
}

Result<ProblemFile> read_problems(const std::filesystem::path& path) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) return Error{path.string() + ": cannot be read"};
  return parse_problems(text, path.string());
}

Result<ProblemFile> parse_problems(std::string_view text, const std::string& name) {
  const std::string where = name.empty() ? "" : name + ": ";
  try {
    const OrderedJson json = OrderedJson::parse(text);
    ProblemFile result;
    result.is_array = json.is_array();
    const auto add = [&](const OrderedJson& problem, const std::string& key) {
      read_document<ProblemStyle>(problem, key, result.problems.emplace_back(), true);
    };
    if (!result.is_array) add(json, "problem");
    for (std::size_t i = 0; result.is_array && i < json.size(); ++i) add(json[i], fmt::format("problem[{}]", i));
    return result;
  } catch (const json::Wrong& wrong) {
    return Error{where + wrong.message};
  } catch (const OrderedJson::exception& error) {
    return Error{where + "is no JSON: " + error.what()};
  }
}

ProblemRecord to_record(const Ocp& ocp, const OcpInstance& instance, const Trajectory& guess, double tolerance) {
  ProblemRecord record;
  record.robot = ocp.model().name;
  record.dt = ocp.dt();
  record.horizon = ocp.horizon();
  record.x0 = instance.x0;
  for (std::size_t i = 0; i < ocp.objectives().size(); ++i) {
    record.weights[ocp.objectives()[i]->name()] = {instance.weights[i].begin(), instance.weights[i].end()};
  }
  record.reference = instance.reference;
  record.position_margin = ocp.position_margin();
  std::copy_if(instance.near.begin(), instance.near.end(), std::back_inserter(record.near),
               [](const NearObstacle& near) { return near.body >= 0; });
  for (const auto& objective : ocp.objectives()) {
    if (objective->name() == "acceleration_step") record.u_followed = instance.u_followed;
    if (objective->name() == "relative_pose") record.held = instance.held;
  }
  record.clearance = instance.clearance;
  record.given = instance.given;
  record.tools = ocp.tool_count();
  for (int t = 0; ocp.liquid() && t < ocp.tool_count(); ++t) {
    const LiquidInstance& liquid = instance.liquid[t];
    record.liquid.push_back({*ocp.liquid(), liquid.counts, liquid.room, liquid.state});
    record.liquid.back().settings.glass = liquid.glass;
  }
  record.guess = guess;
  record.tolerance = tolerance;
  return record;
}

Status write_problems(const std::vector<ProblemRecord>& problems, const std::filesystem::path& path) {
  std::ofstream file(path);
  file << "[";
  for (std::size_t i = 0; i < problems.size(); ++i) {
    file << (i == 0 ? "\n" : ",\n") << document<ProblemStyle>(problems[i]);
  }
  file << "\n]\n";
  file.close();
  if (!file) return Error{path.string() + ": cannot be written"};
  return Done{};
}

std::string to_json(const Solution& solution) { return document<ProblemStyle>(solution); }

}  // namespace steadyhand
