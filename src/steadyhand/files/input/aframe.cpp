#include "steadyhand/files/input/aframe.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <vector>

namespace steadyhand {
namespace {

using Json = nlohmann::json;

constexpr double kDegree = M_PI / 180.0;

/// WebXR axes (x right, y up, z backward) to robot axes (x forward, y left, z up): x' = -z, y' = -x, z' = y.
const Quaternion kRobotFromWebXr{(Matrix3() << 0, 0, -1, -1, 0, 0, 0, 1, 0).finished()};

std::string excerpt(const Json& value) {
  if (value.is_structured()) return value.is_array() ? "an array" : "an object";
  return value.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 40);
}

Result<double> read_number(const Json& object, const char* key, const std::string& where) {
  const auto found = object.find(key);
  if (found == object.end()) return Error{fmt::format("{}: key \"{}\" is missing; it must be a number", where, key)};
  if (!found->is_number()) {
    return Error{fmt::format("{}.{} is {}; it must be a finite number", where, key, excerpt(*found))};
  }
  return found->get<double>();
}

/// {x, y, z} under `key`.
Result<Vector3> read_vector(const Json& pose, const char* key, const std::string& where) {
  const auto found = pose.find(key);
  if (found == pose.end() || !found->is_object()) {
    const std::string what = found == pose.end() ? "missing" : excerpt(*found);
    return Error{fmt::format("{}.{} is {}; it must be an object with the numbers x, y, z", where, key, what)};
  }
  Vector3 vector;
  for (int i = 0; i < 3; ++i) {
    static constexpr const char* kAxes[] = {"x", "y", "z"};
    const Result<double> value = read_number(*found, kAxes[i], fmt::format("{}.{}", where, key));
    if (!value) return value.error();
    vector[i] = *value;
  }
  return vector;
}

Result<SampleList::Row> read_pose(const Json& pose, const std::string& where) {
  if (!pose.is_object()) {
    return Error{
        fmt::format("{} is {}; it must be an object with position, rotation and timestamp", where, excerpt(pose))};
  }
  const Result<Vector3> position = read_vector(pose, "position", where);
  if (!position) return position.error();
  const Result<Vector3> rotation = read_vector(pose, "rotation", where);
  if (!rotation) return rotation.error();
  const Result<double> timestamp = read_number(pose, "timestamp", where);
  if (!timestamp) return timestamp.error();

  using Eigen::AngleAxisd;
  const Vector3 angles = kDegree * *rotation;
  const Quaternion q = AngleAxisd(angles.y(), Vector3::UnitY()) * AngleAxisd(angles.x(), Vector3::UnitX()) *
                       AngleAxisd(angles.z(), Vector3::UnitZ());
  return SampleList::Row{*timestamp * 1e-3, kRobotFromWebXr * *position,
                         kRobotFromWebXr * q * kRobotFromWebXr.conjugate(), true};
}

/// The members that look like a track: objects with "poses".
std::vector<std::string> track_keys(const Json& file) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : file.items()) {
    if (value.is_object() && value.contains("poses")) keys.push_back(key);
  }
  return keys;
}

}  // namespace

Status read_aframe(std::string_view text, const std::string& name, const ChooseHands& choose, SampleList& samples) {
  Json file;
  std::set<std::string> keys;
  std::string twice;  // the parser would keep the last
  const auto see = [&](int depth, Json::parse_event_t event, const Json& parsed) {
    if (depth == 1 && event == Json::parse_event_t::key && !keys.insert(parsed.get<std::string>()).second) {
      twice = parsed.get<std::string>();
    }
    return true;
  };
  try {
    file = Json::parse(text, see);
  } catch (const Json::exception& error) {
    // The parser quotes what it read last, which may be the whole file.
    return Error{fmt::format("{}: is no complete JSON: {}", name, std::string_view(error.what()).substr(0, 200))};
  }
  if (!file.is_object()) {
    return Error{
        fmt::format("{}: is {}; an A-Frame recording is an object with one member per track", name, excerpt(file))};
  }
  if (!twice.empty()) return Error{fmt::format("{}: has two tracks \"{}\"; each needs its own name", name, twice)};
  const std::vector<std::string> tracks = track_keys(file);
  if (tracks.empty()) {
    return Error{fmt::format("{}: holds no track; an A-Frame recording is {{\"rhand\": {{\"poses\": [...]}}}}", name)};
  }
  const Result<std::vector<ChosenHand>> hands = choose(tracks);
  if (!hands) return hands.error();
  for (const auto& [key, tool] : *hands) {
    const Json& poses = file[key]["poses"];
    if (!poses.is_array()) {
      return Error{fmt::format("{}: {}.poses is {}; it must be an array", name, key, excerpt(poses))};
    }
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const std::string where = fmt::format("{}: {}.poses[{}]", name, key, i);
      const Result<SampleList::Row> row = read_pose(poses[i], where);
      if (!row) return row.error();
      if (const Status added = samples.add(*row, where, tool); !added) return added;
    }
  }
  return Done{};
}

}  // namespace steadyhand
