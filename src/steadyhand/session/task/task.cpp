#include "steadyhand/session/task/task.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace steadyhand {

std::optional<int> Task::find(const std::string& thing) const {
  const auto found = std::find(things.begin(), things.end(), thing);
  if (found == things.end()) return std::nullopt;
  return static_cast<int>(found - things.begin());
}

Status find_tools(Task& task, const std::vector<std::string>& tools) {
  for (std::size_t i = 0; i < task.moves.size(); ++i) {
    Move& move = task.moves[i];
    const auto found = std::find(tools.begin(), tools.end(), move.tool_name);
    if (!move.tool_name.empty() && found == tools.end()) {
      return Error{fmt::format("task '{}': moves[{}].tool is '{}'; the robot's tools are: {}", task.name, i,
                               move.tool_name, fmt::join(tools, ", "))};
    }
    move.tool = move.tool_name.empty() ? 0 : static_cast<int>(found - tools.begin());
  }
  return Done{};
}

Result<std::vector<Pose>> draw_places(const Task& task, std::uint64_t seed) {
  constexpr int kDraws = 1000;
  std::mt19937_64 random(seed);
  // Not std::uniform_real_distribution, whose numbers differ from library to library.
  const auto within = [&](const std::array<double, 2>& range) {
    return range[0] + (range[1] - range[0]) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<Pose> places(task.placings.size());
  for (int draw = 0; draw < kDraws; ++draw) {
    bool fits = true;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Placing& placing = task.placings[i];
      places[i].p = {within(placing.x), within(placing.y), placing.z};
      places[i].q = Quaternion(Eigen::AngleAxisd(within(placing.yaw), Vector3::UnitZ()));
      for (std::size_t j = 0; j < i; ++j) fits = fits && (places[i].p - places[j].p).norm() >= task.apart;
    }
    if (fits) return places;
  }
  return Error{
      fmt::format("task '{}': no places that are {} m apart were found in {} draws", task.name, task.apart, kDraws)};
}

double heading(const Pose& X) {
  const Vector3 x = X.q * Vector3::UnitX();
  return std::atan2(x.y(), x.x());
}

bool holds(const Condition& c, const SceneState& scene, double spilled) {
  const ThingState& thing = scene.thing[c.thing];
  const ThingState& other = scene.thing[c.other];
  switch (c.kind) {
    case Condition::Kind::kNear: {
      const Vector3 way = thing.X_base_thing.p - other.X_base_thing.p;
      return way.head<2>().norm() <= c.most && std::abs(way.z()) <= c.height;
    }
    case Condition::Kind::kUpright:
      return (thing.X_base_thing.q * Vector3::UnitZ()).z() >= std::cos(c.most);
    case Condition::Kind::kStill:
      return thing.velocity.norm() <= c.most && thing.turning.norm() <= 10.0 * c.most;
    case Condition::Kind::kTouches:
      return (thing.touches >> c.other & 1u) != 0;
    case Condition::Kind::kApart:
      return (thing.touches >> c.other & 1u) == 0;
    case Condition::Kind::kReleased:
      return !thing.grasped;
    case Condition::Kind::kAligned:
      return std::abs(std::remainder(heading(thing.X_base_thing) - heading(other.X_base_thing), c.symmetry)) <= c.most;
    case Condition::Kind::kSpilled:
      return spilled <= c.most;
  }
  return false;
}

const TaskProgress& TaskJudge::update(const SceneState& scene, double spilled) {
  const bool anew = std::exchange(reset_, scene.reset) != scene.reset;
  if (anew) begin_.reset();
  if (anew || begins_) {
    if (begins_ || !waits_) begin_ = scene.at;
    begins_ = all_ = false;
    progress_ = {};
    before_ = spilled;
  }
  if (!progress_.success) {
    progress_.spilled += spilled >= before_ ? spilled - before_ : spilled;
    progress_.time = begin_ ? to_seconds(scene.at - *begin_) : 0.0;
    progress_.held = 0;
    for (std::size_t i = 0; i < task_->success.size(); ++i) {
      if (holds(task_->success[i], scene, progress_.spilled)) progress_.held |= 1u << i;
    }
    const bool all = progress_.held + 1u == 1u << task_->success.size();
    if (all && !all_) all_since_ = scene.at;
    all_ = all && begin_;
    if (all_ && to_seconds(scene.at - all_since_) >= task_->hold) {
      progress_.success = true;
    } else if (progress_.time > task_->time_limit) {
      progress_.success = false;
    }
  }
  before_ = spilled;
  return progress_;
}

}  // namespace steadyhand
