#pragma once

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "steadyhand/core/math.hpp"

namespace steadyhand {

using OrderedJson = nlohmann::ordered_json;  ///< keys in the order of docs/explanation/formulation.md

/// Reading JSON strictly: what is missing or of another kind throws Wrong.
namespace json {

/// Carries the first thing that is wrong out of nested readers; does not leave their room.
struct Wrong {
  std::string message;
};

[[noreturn]] inline void fail(const std::string& key, const std::string& what) { throw Wrong{key + ": " + what}; }

inline const OrderedJson& member(const OrderedJson& object, const std::string& key, const std::string& name) {
  const auto found = object.find(name);
  if (found == object.end()) fail(key + "." + name, "is missing");
  return *found;
}

inline double number(const OrderedJson& json, const std::string& key) {
  if (!json.is_number()) fail(key, fmt::format("is {}; it must be a number", json.dump()));
  const double value = json.get<double>();
  if (!std::isfinite(value)) fail(key, "is not finite");
  return value;
}

inline double positive(const OrderedJson& json, const std::string& key) {
  const double value = number(json, key);
  if (value <= 0.0) fail(key, fmt::format("is {}; it must be positive", value));
  return value;
}

inline std::string text(const OrderedJson& json, const std::string& key) {
  if (!json.is_string()) fail(key, "must be a text");
  return json.get<std::string>();
}

/// @param size of the array, or -1 for any
inline const OrderedJson& array(const OrderedJson& json, const std::string& key, std::ptrdiff_t size) {
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

inline Matrix3 rotation_matrix(const OrderedJson& json, const std::string& key) {
  Matrix3 R;
  array(json, key, 3);
  for (int row = 0; row < 3; ++row) R.row(row) = vector<Eigen::VectorXd>(json[row], fmt::format("{}[{}]", key, row), 3);
  if ((R * R.transpose() - Matrix3::Identity()).norm() > 1e-6 || R.determinant() < 0.0) {
    fail(key, "is no rotation matrix: its rows must be orthonormal, its determinant 1");
  }
  return R;
}

}  // namespace json
}  // namespace steadyhand
