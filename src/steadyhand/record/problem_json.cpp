#include "steadyhand/record/problem_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

namespace steadyhand {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// Carries the first thing that is wrong out of the nested readers; does not leave this file.
struct Wrong {
  std::string message;
};

[[noreturn]] void fail(const std::string& key, const std::string& what) { throw Wrong{key + ": " + what}; }

const OrderedJson& member(const OrderedJson& object, const std::string& key, const std::string& name) {
  const auto found = object.find(name);
  if (found == object.end()) fail(key + "." + name, "is missing");
  return *found;
}

double number(const OrderedJson& json, const std::string& key) {
  if (!json.is_number()) fail(key, fmt::format("is {}; it must be a number", json.dump()));
  const double value = json.get<double>();
  if (!std::isfinite(value)) fail(key, "is not finite");
  return value;
}

double positive(const OrderedJson& json, const std::string& key) {
  const double value = number(json, key);
  if (value <= 0.0) fail(key, fmt::format("is {}; it must be positive", value));
  return value;
}

/// @param size of the array, or -1 for any
const OrderedJson& array(const OrderedJson& json, const std::string& key, std::ptrdiff_t size) {
  if (!json.is_array()) fail(key, "must be an array");
  if (size >= 0 && std::ssize(json) != size)
    fail(key, fmt::format("has {} entries; it must have {}", json.size(), size));
  return json;
}

template <typename Vector>
Vector vector(const OrderedJson& json, const std::string& key, std::ptrdiff_t size) {
  array(json, key, size);
  Vector result(json.size());
  for (std::size_t i = 0; i < json.size(); ++i) result[i] = number(json[i], fmt::format("{}[{}]", key, i));
  return result;
}

Matrix3 rotation_matrix(const OrderedJson& json, const std::string& key) {
  Matrix3 R;
  array(json, key, 3);
  for (int row = 0; row < 3; ++row) R.row(row) = vector<Eigen::VectorXd>(json[row], fmt::format("{}[{}]", key, row), 3);
  if ((R * R.transpose() - Matrix3::Identity()).norm() > 1e-6 || R.determinant() < 0.0) {
    fail(key, "is no rotation matrix: its rows must be orthonormal, its determinant 1");
  }
  return R;
}

Trajectory trajectory(const OrderedJson& json, const std::string& key, int horizon, std::ptrdiff_t states) {
  Trajectory result;
  const OrderedJson &x = array(member(json, key, "x"), key + ".x", horizon + 1),
                    &u = array(member(json, key, "u"), key + ".u", horizon);
  for (int k = 0; k <= horizon; ++k)
    result.x.push_back(vector<StateVector>(x[k], fmt::format("{}.x[{}]", key, k), states));
  for (int k = 0; k < horizon; ++k)
    result.u.push_back(vector<JointVector>(u[k], fmt::format("{}.u[{}]", key, k), states / 2));
  return result;
}

ProblemRecord problem(const OrderedJson& json, const std::string& key) {
  if (!json.is_object()) fail(key, "must be an object");
  static const std::set<std::string> known{"robot",   "dt",        "horizon", "x0",
                                           "weights", "reference", "guess",   "tolerance"};
  for (const auto& [name, value] : json.items()) {
    if (!known.contains(name)) {
      fail(key + "." + name, "is unknown; the keys are robot, dt, horizon, x0, weights, reference, guess, tolerance");
    }
  }
  ProblemRecord result;
  const OrderedJson& robot = member(json, key, "robot");
  if (!robot.is_string()) fail(key + ".robot", "must be a string");
  result.robot = robot.get<std::string>();
  result.dt = positive(member(json, key, "dt"), key + ".dt");
  const OrderedJson& horizon = member(json, key, "horizon");
  if (!horizon.is_number_integer() || horizon < 1 || horizon > kMaxHorizon) {
    fail(key + ".horizon", fmt::format("is {}; it must be a whole number from 1 to {}", horizon.dump(), kMaxHorizon));
  }
  result.horizon = horizon.get<int>();

  const OrderedJson& x0 = array(member(json, key, "x0"), key + ".x0", -1);
  if (x0.empty() || x0.size() % 2 != 0 || x0.size() > 2 * kMaxJoints) {
    fail(key + ".x0",
         fmt::format("has {} entries; it must have 2n for n joints, n from 1 to {}", x0.size(), kMaxJoints));
  }
  result.x0 = vector<StateVector>(x0, key + ".x0", -1);

  const OrderedJson& weights = member(json, key, "weights");
  if (!weights.is_object()) fail(key + ".weights", "must be an object");
  for (const auto& [name, value] : weights.items()) {
    const std::string weight_key = key + ".weights." + name;
    result.weights[name] = value.is_array() ? vector<std::vector<double>>(value, weight_key, -1)
                                            : std::vector<double>{number(value, weight_key)};
  }

  const OrderedJson& reference = array(member(json, key, "reference"), key + ".reference", result.horizon);
  result.reference.nodes = result.horizon;
  result.reference.dt = result.dt;
  for (int k = 0; k < result.horizon; ++k) {
    const std::string node_key = fmt::format("{}.reference[{}]", key, k);
    if (!reference[k].is_object()) fail(node_key, "must be an object");
    result.reference.p[k] = vector<Eigen::VectorXd>(member(reference[k], node_key, "p"), node_key + ".p", 3);
    result.reference.R[k] = rotation_matrix(member(reference[k], node_key, "R"), node_key + ".R");
  }
  if (json.contains("guess") && !json["guess"].is_null()) {
    if (!json["guess"].is_object()) fail(key + ".guess", "must be an object");
    result.guess = trajectory(json["guess"], key + ".guess", result.horizon, result.x0.size());
  }
  if (json.contains("tolerance")) result.tolerance = positive(json["tolerance"], key + ".tolerance");
  return result;
}

template <typename Vector>
OrderedJson to_array(const Vector& vector) {
  OrderedJson result = OrderedJson::array();
  for (const double value : vector) result.push_back(value);
  return result;
}

template <typename Vectors>
OrderedJson to_arrays(const Vectors& vectors) {
  OrderedJson result = OrderedJson::array();
  for (const auto& vector : vectors) result.push_back(to_array(vector));
  return result;
}

OrderedJson to_json(const ProblemRecord& problem) {
  OrderedJson reference = OrderedJson::array();
  for (int k = 0; k < problem.horizon; ++k) {
    OrderedJson rows = OrderedJson::array();
    for (int row = 0; row < 3; ++row) rows.push_back(to_array(Vector3(problem.reference.R[k].row(row))));
    reference.push_back({{"p", to_array(problem.reference.p[k])}, {"R", rows}});
  }
  OrderedJson json{{"robot", problem.robot},           {"dt", problem.dt},
                   {"horizon", problem.horizon},       {"x0", to_array(problem.x0)},
                   {"weights", OrderedJson::object()}, {"reference", reference},
                   {"tolerance", problem.tolerance}};
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
  } catch (const Wrong& wrong) {
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
