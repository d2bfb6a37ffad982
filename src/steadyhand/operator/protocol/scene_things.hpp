#pragma once

#include <utility>
#include <vector>

#include "steadyhand/session/live/live_session.hpp"
#include "steadyhand/session/task/scene_state.hpp"

namespace steadyhand {

/// The things of a simulated scene in a session's cell: each at its place, and attached to a tool while both fingers of
/// its gripper touch it. One thread.
class SceneThings {
 public:
  /// @param solids of things, by their index, in their frame
  explicit SceneThings(std::vector<std::pair<int, CellObject>> solids) : solids_(std::move(solids)) {}

  /// Changes the cell when a thing was grasped or released, and every 100 ms if a thing has moved. Fails as
  /// Session::set_cell; then the cell stays.
  Status follow(const SceneState& scene, Session& session);
  bool known() const { return !shown_.empty(); }  ///< the cell has them

 private:
  std::vector<std::pair<int, CellObject>> solids_;
  std::vector<ThingState> shown_;  ///< for each solid its thing, as it is in the cell
  Time shown_at_{0};
};

/// Share of the liquid that has left a glass; of two glasses the larger.
double spilled_share(const SessionSnapshot& snapshot);

}  // namespace steadyhand
