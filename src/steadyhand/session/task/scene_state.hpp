#pragma once

#include <array>
#include <cstdint>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Largest number of things in a task's scene.
inline constexpr int kMaxThings = 16;

/// Pose and motion of a thing in a simulated scene.
struct ThingState {
  Pose X_base_thing;
  Vector3 velocity = Vector3::Zero();  ///< m/s, base frame
  Vector3 turning = Vector3::Zero();   ///< rad/s, base frame
  std::uint32_t touches = 0;           ///< a bit for each thing that it is in contact with, by index
  bool grasped = false;                ///< two fingers of a gripper touch it
  int grasped_by = 0;                  ///< index of the tool that this gripper is; of two, that which did first
};

/// A simulated scene at one time: the things that its task names, in that order.
struct SceneState {
  Time at{0};
  std::uint64_t reset = 0;      ///< number of times the scene was set up again before
  std::uint64_t forbidden = 0;  ///< contacts of the arm with things that it must not touch, started since then
  int things = 0;
  std::array<ThingState, kMaxThings> thing{};
};

}  // namespace steadyhand
