#pragma once

#include <utility>
#include <vector>

#include "steadyhand/session/live/live_session.hpp"
#include "steadyhand/session/task/scene_state.hpp"

namespace steadyhand {

/// The things of a simulated scene in a session's cell: each at its place, and attached to the tool while both fingers
/// of the gripper touch it. One thread.
class SceneThings {
 public:
  /// @param solids of things, by their index, in their frame
  explicit SceneThings(std::vector<std::pair<int, CellObject>> solids) : solids_(std::move(solids)) {}

  /// Changes the cell when a thing was grasped or released, and every 100 ms if a thing has moved. Fails as
  /// Session::set_cell; then the cell stays.
  Status follow(const SceneState& scene, Session& session);
  bool known() const { return !shown_.empty(); }  ///< the cell has them

 private:
  /// The thing of a solid, as it is in the cell.
  struct Shown {
    Pose X_base_thing;
    bool grasped = false;
  };

  std::vector<std::pair<int, CellObject>> solids_;
  std::vector<Shown> shown_;  ///< for each solid
  Time shown_at_{0};
};

}  // namespace steadyhand
