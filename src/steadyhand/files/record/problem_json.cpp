#include "steadyhand/files/record/problem_json.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include "steadyhand/files/record/json_reader.hpp"
#include "steadyhand/files/record/model_json.hpp"

namespace steadyhand {
namespace {

Trajectory trajectory(const OrderedJson& json, const std::string& key, int horizon, std::ptrdiff_t states) {
  Trajectory result;
  const OrderedJson &x = json::array(json::member(json, key, "x"), key + ".x", horizon + 1),
                    &u = json::array(json::member(json, key, "u"), key + ".u", horizon);
  for (int k = 0; k <= horizon; ++k)
    result.x.push_back(json::vector<StateVector>(x[k], fmt::format("{}.x[{}]", key, k), states));
  for (int k = 0; k < horizon; ++k)
    result.u.push_back(json::vector<JointVector>(u[k], fmt::format("{}.u[{}]", key, k), states / 2));
  return result;
}

Obstacle read_solid(const OrderedJson& json, const std::string& key) {
  Obstacle result;
  const Eigen::Isometry3d origin = read_shape_json(json, key, result.shape);
  result.at = {origin.translation(), origin.linear()};
  return result;
}

OrderedJson solid_json(const Obstacle& obstacle) {
  return shape_json(obstacle.shape,
                    Eigen::Translation3d(obstacle.at.p) * Eigen::Isometry3d(Eigen::Quaterniond(obstacle.at.R)));
}

NearObstacles obstacles(const OrderedJson& json, const std::string& key) {
  json::array(json, key, -1);
  if (json.size() > kMaxObstacleRows)
    json::fail(key, fmt::format("has {} entries; it may have {} at most", json.size(), kMaxObstacleRows));
  NearObstacles result;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const std::string entry = fmt::format("{}[{}]", key, i);
    if (!json[i].is_object()) json::fail(entry, "must be an object");
    const OrderedJson& body = json::member(json[i], entry, "body");
    const bool of_arm = body.is_number_integer() && body >= 0 && body < kMaxBodies;
    if (!of_arm && !body.is_object()) {
      json::fail(entry + ".body",
                 fmt::format("is {}; it must be the index of a body, or what the tool carries", body.dump()));
    }
    Obstacle obstacle = read_solid(json[i], entry), carried;
    if (!of_arm) carried = read_solid(body, entry + ".body");
    if (json[i].contains("carried")) {
      if (!json[i]["carried"].is_boolean()) json::fail(entry + ".carried", "must be true or false");
      obstacle.carried = json[i]["carried"].get<bool>();
    }
    if (json[i].contains("velocity"))
      obstacle.velocity = json::vector<Eigen::VectorXd>(json[i]["velocity"], entry + ".velocity", 3);
    double depth = 0.0;
    if (json[i].contains("depth")) depth = json::number(json[i]["depth"], entry + ".depth");
    if (depth < 0.0) json::fail(entry + ".depth", fmt::format("is {}; it must be 0 or more", depth));
    int corner = -1;
    if (json[i].contains("corner")) {
      const OrderedJson& index = json[i]["corner"];
      if (!index.is_number_integer() || index < -1 || index > 7)
        json::fail(entry + ".corner", fmt::format("is {}; it must be the index of a corner, or -1", index.dump()));
      corner = index.get<int>();
    }
    result.push_back({of_arm ? body.get<int>() : kMaxBodies, obstacle, depth, corner, carried});
  }
  return result;
}

/// The numbers of a liquid that stand under a key of their own.
template <typename Liquid, typename Each>
void for_each_number(Liquid& liquid, const Each& each) {
  auto& settings = liquid.settings;
  each("radius", settings.glass.radius);
  each("height", settings.glass.height);
  each("fill", settings.glass.fill);
  each("viscosity", settings.glass.viscosity);
  each("frequency_factor", settings.glass.frequency_factor);
  each("price", settings.price);
  each("least_weight", settings.least_weight);
  each("lean", settings.lean_max);
  each("room", liquid.room);
}

LiquidRecord liquid(const OrderedJson& json, const std::string& key) {
  if (!json.is_object()) json::fail(key, "must be an object");
  LiquidRecord result;
  std::set<std::string> known{"frequencies", "state", "counts"};
  for_each_number(result, [&](const char* name, double& value) {
    known.insert(name);
    value = json::number(json::member(json, key, name), key + "." + name);
  });
  for (const auto& [name, value] : json.items()) {
    if (!known.contains(name))
      json::fail(key + "." + name, fmt::format("is unknown; the keys are {}", fmt::join(known, ", ")));
  }
  const auto factors =
      json::vector<std::vector<double>>(json::member(json, key, "frequencies"), key + ".frequencies", kSloshModes);
  std::copy(factors.begin(), factors.end(), result.settings.frequencies.begin());
  result.state = json::vector<Eigen::VectorXd>(json::member(json, key, "state"), key + ".state", kSloshStates);
  if (json.contains("counts")) {
    if (!json["counts"].is_boolean()) json::fail(key + ".counts", "must be true or false");
    result.counts = json["counts"].get<bool>();
  }
  return result;
}

ProblemRecord problem(const OrderedJson& json, const std::string& key) {
  if (!json.is_object()) json::fail(key, "must be an object");
  static const std::set<std::string> known{"robot",      "dt",        "horizon", "x0",        "weights",
                                           "reference",  "obstacles", "guess",   "tolerance", "position_margin",
                                           "u_followed", "clearance", "liquid"};
  for (const auto& [name, value] : json.items()) {
    if (!known.contains(name)) {
      json::fail(key + "." + name,
                 "is unknown; the keys are robot, dt, horizon, x0, weights, reference, position_margin, obstacles, "
                 "u_followed, clearance, liquid, guess, tolerance");
    }
  }
  ProblemRecord result;
  const OrderedJson& robot = json::member(json, key, "robot");
  if (!robot.is_string()) json::fail(key + ".robot", "must be a string");
  result.robot = robot.get<std::string>();
  result.dt = json::positive(json::member(json, key, "dt"), key + ".dt");
  const OrderedJson& horizon = json::member(json, key, "horizon");
  if (!horizon.is_number_integer() || horizon < 1 || horizon > kMaxHorizon) {
    json::fail(key + ".horizon",
               fmt::format("is {}; it must be a whole number from 1 to {}", horizon.dump(), kMaxHorizon));
  }
  result.horizon = horizon.get<int>();

  const OrderedJson& x0 = json::array(json::member(json, key, "x0"), key + ".x0", -1);
  if (x0.empty() || x0.size() % 2 != 0 || x0.size() > 2 * kMaxJoints) {
    json::fail(key + ".x0",
               fmt::format("has {} entries; it must have 2n for n joints, n from 1 to {}", x0.size(), kMaxJoints));
  }
  result.x0 = json::vector<StateVector>(x0, key + ".x0", -1);

  const OrderedJson& weights = json::member(json, key, "weights");
  if (!weights.is_object()) json::fail(key + ".weights", "must be an object");
  for (const auto& [name, value] : weights.items()) {
    const std::string weight_key = key + ".weights." + name;
    result.weights[name] = value.is_array() ? json::vector<std::vector<double>>(value, weight_key, -1)
                                            : std::vector<double>{json::number(value, weight_key)};
  }

  const OrderedJson& reference = json::array(json::member(json, key, "reference"), key + ".reference", result.horizon);
  result.reference.nodes = result.horizon;
  result.reference.dt = result.dt;
  for (int k = 0; k < result.horizon; ++k) {
    const std::string node_key = fmt::format("{}.reference[{}]", key, k);
    if (!reference[k].is_object()) json::fail(node_key, "must be an object");
    result.reference.p[k] =
        json::vector<Eigen::VectorXd>(json::member(reference[k], node_key, "p"), node_key + ".p", 3);
    result.reference.R[k] = json::rotation_matrix(json::member(reference[k], node_key, "R"), node_key + ".R");
  }
  if (json.contains("position_margin")) {
    result.position_margin =
        json::vector<JointVector>(json["position_margin"], key + ".position_margin", x0.size() / 2);
  }
  if (json.contains("obstacles")) result.near = obstacles(json["obstacles"], key + ".obstacles");
  if (json.contains("u_followed"))
    result.u_followed = json::vector<JointVector>(json["u_followed"], key + ".u_followed", x0.size() / 2);
  if (json.contains("clearance")) result.clearance = json::number(json["clearance"], key + ".clearance");
  if (json.contains("liquid")) result.liquid = liquid(json["liquid"], key + ".liquid");
  if (json.contains("guess") && !json["guess"].is_null()) {
    if (!json["guess"].is_object()) json::fail(key + ".guess", "must be an object");
    result.guess = trajectory(json["guess"], key + ".guess", result.horizon, result.x0.size());
  }
  if (json.contains("tolerance")) result.tolerance = json::positive(json["tolerance"], key + ".tolerance");
  return result;
}

template <typename Vectors>
OrderedJson to_arrays(const Vectors& vectors) {
  OrderedJson result = OrderedJson::array();
  for (const auto& vector : vectors) result.push_back(numbers_json(vector));
  return result;
}

OrderedJson to_json(const ProblemRecord& problem) {
  OrderedJson reference = OrderedJson::array();
  for (int k = 0; k < problem.horizon; ++k) {
    OrderedJson rows = OrderedJson::array();
    for (int row = 0; row < 3; ++row) rows.push_back(numbers_json(Vector3(problem.reference.R[k].row(row))));
    reference.push_back({{"p", numbers_json(problem.reference.p[k])}, {"R", rows}});
  }
  OrderedJson json{{"robot", problem.robot},           {"dt", problem.dt},
                   {"horizon", problem.horizon},       {"x0", numbers_json(problem.x0)},
                   {"weights", OrderedJson::object()}, {"reference", reference},
                   {"tolerance", problem.tolerance}};
  if (problem.position_margin.size() > 0) json["position_margin"] = numbers_json(problem.position_margin);
  for (const NearObstacle& near : problem.near) {
    const Obstacle& obstacle = near.obstacle;
    OrderedJson entry{{"body", near.body < kMaxBodies ? OrderedJson(near.body) : solid_json(near.carried)}};
    entry.update(solid_json(obstacle));
    if (obstacle.carried) entry["carried"] = true;
    entry["velocity"] = numbers_json(obstacle.velocity);
    entry["depth"] = near.depth;
    if (near.corner >= 0) entry["corner"] = near.corner;
    json["obstacles"].push_back(std::move(entry));
  }
  if (problem.u_followed.size() > 0) json["u_followed"] = numbers_json(problem.u_followed);
  if (problem.clearance > 0.0) json["clearance"] = problem.clearance;
  if (problem.liquid) {
    OrderedJson& liquid = json["liquid"];
    for_each_number(*problem.liquid, [&](const char* name, double value) { liquid[name] = value; });
    liquid["frequencies"] = problem.liquid->settings.frequencies;
    liquid["counts"] = problem.liquid->counts;
    liquid["state"] = numbers_json(problem.liquid->state);
  }
  for (const auto& [name, values] : problem.weights) {
    json["weights"][name] = values.size() == 1 ? OrderedJson(values[0]) : OrderedJson(values);
  }
  if (problem.guess) json["guess"] = {{"x", to_arrays(problem.guess->x)}, {"u", to_arrays(problem.guess->u)}};
  return json;
}

}  // namespace

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
    if (!result.is_array) {
      result.problems.push_back(problem(json, "problem"));
    } else {
      for (std::size_t i = 0; i < json.size(); ++i)
        result.problems.push_back(problem(json[i], fmt::format("problem[{}]", i)));
    }
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
  for (const auto& objective : ocp.objectives())
    if (objective->name() == "acceleration_step") record.u_followed = instance.u_followed;
  record.clearance = instance.clearance;
  if (ocp.liquid()) {
    const LiquidInstance& liquid = instance.liquid;
    record.liquid = {*ocp.liquid(), liquid.counts, liquid.room, liquid.state};
    record.liquid->settings.glass = liquid.glass;
  }
  record.guess = guess;
  record.tolerance = tolerance;
  return record;
}

Status write_problems(const std::vector<ProblemRecord>& problems, const std::filesystem::path& path) {
  std::ofstream file(path);
  file << "[";
  for (std::size_t i = 0; i < problems.size(); ++i) file << (i == 0 ? "\n" : ",\n") << to_json(problems[i]).dump();
  file << "\n]\n";
  file.close();
  if (!file) return Error{path.string() + ": cannot be written"};
  return Done{};
}

std::string to_json(const Solution& solution) {
  const OrderedJson json{{"status", to_string(solution.status)}, {"objective", solution.objective},
                         {"iterations", solution.iterations},    {"time_us", solution.time_us},
                         {"kkt_error", solution.kkt_error},      {"x", to_arrays(solution.trajectory.x)},
                         {"u", to_arrays(solution.trajectory.u)}};
  return json.dump();
}

}  // namespace steadyhand
