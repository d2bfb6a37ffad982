#pragma once

#include <memory>
#include <string>
#include <vector>

#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/core/video.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// The cameras that film, from the command line: --camera, which may be repeated.
struct CameraChoice {
  std::vector<std::string> cameras;  ///< NAME, NAME=DEVICE or NAME=FILE, or only "none"; empty: those of the task
};

void add_camera_options(CommandLine& command, CameraChoice& choice);

/// The cameras that were chosen; null: none. Without a choice those of the task; if they are not available, there
/// are none and `note` has the reason. Before the arm's first cycle; arm and clock must outlive them. Fails on what
/// cannot be read, on names that the scene does not have, and where this program was built without cameras.
/// @param like size and rate of each
Result<std::unique_ptr<Cameras>> open_cameras(const CameraChoice& choice, const Task& task, const CameraInfo& like,
                                              Arm& arm, Clock& clock, std::string& note);

}  // namespace steadyhand
