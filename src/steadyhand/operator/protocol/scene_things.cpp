#include "steadyhand/operator/protocol/scene_things.hpp"

#include <algorithm>

namespace steadyhand {

namespace {

constexpr Time kPeriod = std::chrono::milliseconds(100);
constexpr double kSeenDistance = 0.001, kSeenTurn = 0.01;  // m, rad

}  // namespace

Status SceneThings::follow(const SceneState& scene, Session& session) {
  if (solids_.empty()) return Done{};
  const auto same_grasp = [](const ThingState& a, const ThingState& b) {
    return a.grasped == b.grasped && (!a.grasped || a.grasped_by == b.grasped_by);
  };
  bool moved = shown_.empty(), grasps = false;
  for (std::size_t i = 0; i < shown_.size(); ++i) {
    const ThingState& thing = scene.thing[solids_[i].first];
    const Pose& before = shown_[i].X_base_thing;
    grasps |= !same_grasp(thing, shown_[i]);
    moved |= !thing.grasped && ((thing.X_base_thing.p - before.p).norm() > kSeenDistance ||
                                thing.X_base_thing.q.angularDistance(before.q) > kSeenTurn);
  }
  if (!grasps && (!moved || (known() && scene.at - shown_at_ < kPeriod))) return Done{};
  const Status done = session.change_cell(
      [&](Cell cell) -> Result<Cell> {
        for (std::size_t i = 0; i < solids_.size(); ++i) {
          const auto& [thing, solid] = solids_[i];
          const auto named = std::find_if(cell.objects.begin(), cell.objects.end(),
                                          [&](const CellObject& other) { return other.name == solid.name; });
          CellObject& object = named == cell.objects.end() ? cell.objects.emplace_back() : *named;
          const ThingState& now = scene.thing[thing];
          const bool stays_in_tool = object.attached && now.grasped && object.tool == now.grasped_by;
          if (stays_in_tool) continue;
          const Pose& at = now.X_base_thing;
          object = solid;
          object.origin = Eigen::Translation3d(at.p) * at.q * solid.origin;
          if (!now.grasped) continue;
          const Result<Kinematics> arm = session.arm_at(scene.at);
          if (!arm) return arm.error();
          Result<Cell> attached = attach(std::move(cell), solid.name, *arm, now.grasped_by);
          if (!attached) return attached.error();
          cell = *std::move(attached);
        }
        return cell;
      },
      scene.at);
  if (!done) return done;
  shown_.clear();
  for (const auto& [thing, solid] : solids_) shown_.push_back(scene.thing[thing]);
  shown_at_ = scene.at;
  return Done{};
}

double spilled_share(const SessionSnapshot& snapshot) {
  double most = 0.0;
  for (int t = 0; t < snapshot.tool_count; ++t) most = std::max(most, snapshot.tools[t].liquid.spilled_share);
  return most;
}

}  // namespace steadyhand
