#pragma once

#include "steadyhand/core/result.hpp"
#include "steadyhand/session/task/scene_state.hpp"

namespace steadyhand {

/// A simulated scene that can be set up again while it runs.
class SimulatedScene {
 public:
  virtual ~SimulatedScene() = default;
  /// Puts the things of its task into new places soon. One thread at a time. Fails as draw_places does.
  virtual Status set_up(std::uint64_t seed) = 0;
  /// The newest state, if there is one since the last call. One thread.
  virtual bool read_scene(SceneState& state) = 0;

 protected:
  SimulatedScene() = default;
};

}  // namespace steadyhand
