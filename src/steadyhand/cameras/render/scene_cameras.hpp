#pragma once

#include <memory>
#include <string>
#include <vector>

#include "steadyhand/arms/mujoco/mujoco_arm.hpp"
#include "steadyhand/cameras/video/picture_source.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Cameras of a simulated scene, those that its MJCF names: MuJoCo draws what they see, without a screen, by EGL; on a
/// graphics card, or else by Mesa's drawing in software. A picture counts as exposed when the simulation was as it
/// shows it, at most a cycle ago. The arm never waits. Arm and clock must outlive it; before the arm's first cycle.
/// Fails on cameras that the scene does not have, and where there is no OpenGL.
Result<std::unique_ptr<PictureSource>> make_scene_cameras(MujocoArm& arm, const std::vector<CameraInfo>& cameras,
                                                          Clock& clock);

}  // namespace steadyhand
