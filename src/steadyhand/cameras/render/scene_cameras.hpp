#pragma once

#include <memory>
#include <string>
#include <vector>

#include "steadyhand/arms/mujoco/mujoco_arm.hpp"
#include "steadyhand/cameras/video/picture_source.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Cameras of a simulated scene, by their names in its MJCF. MuJoCo draws their pictures by EGL, without a screen, on a
/// graphics card or otherwise in software by Mesa. The exposure time of a picture is the time of the simulation state
/// that it shows, at most one cycle old. The arm never waits. Arm and clock must outlive it. Call it before the arm's
/// first cycle. Fails if the scene does not have a camera, or if there is no OpenGL.
Result<std::unique_ptr<PictureSource>> make_scene_cameras(MujocoArm& arm, const std::vector<CameraInfo>& cameras,
                                                          Clock& clock);

}  // namespace steadyhand
