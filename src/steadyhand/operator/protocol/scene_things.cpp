#include "steadyhand/operator/protocol/scene_things.hpp"

#include <algorithm>

namespace steadyhand {

namespace {

constexpr Time kPeriod = std::chrono::milliseconds(100);
constexpr double kSeenDistance = 0.001, kSeenTurn = 0.01;  // m, rad

}  // namespace

Status SceneThings::follow(const SceneState& scene, Session& session) {
  if (solids_.empty()) return Done{};
  bool moved = shown_.empty(), grasps = false;
  for (std::size_t i = 0; i < shown_.size(); ++i) {
    const ThingState& thing = scene.thing[solids_[i].first];
    const Pose& before = shown_[i].X_base_thing;
    grasps |= thing.grasped != shown_[i].grasped;
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
          const bool stays_in_tool = object.attached && scene.thing[thing].grasped;
          if (stays_in_tool) continue;
          const Pose& at = scene.thing[thing].X_base_thing;
          object = solid;
          object.origin = Eigen::Translation3d(at.p) * at.q * solid.origin;
          if (!scene.thing[thing].grasped) continue;
          const Result<Kinematics> arm = session.arm_at(scene.at);
          if (!arm) return arm.error();
          Result<Cell> attached = attach(std::move(cell), solid.name, *arm);
          if (!attached) return attached.error();
          cell = *std::move(attached);
        }
        return cell;
      },
      scene.at);
  if (!done) return done;
  shown_.resize(solids_.size());
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    const ThingState& thing = scene.thing[solids_[i].first];
    shown_[i] = {thing.X_base_thing, thing.grasped};
  }
  shown_at_ = scene.at;
  return Done{};
}

}  // namespace steadyhand
