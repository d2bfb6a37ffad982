#include "steadyhand/apps/commands/camera_choice.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <utility>
#ifdef STEADYHAND_CAMERA
#include "steadyhand/cameras/video/camera_set.hpp"
#include "steadyhand/cameras/video/file_source.hpp"
#include "steadyhand/cameras/video/v4l2_source.hpp"
#endif
#ifdef STEADYHAND_RENDER
#include "steadyhand/cameras/render/scene_cameras.hpp"
#endif

namespace steadyhand {

namespace {

/// One --camera, taken apart.
struct NamedCamera {
  CameraInfo camera;
  std::string file;  ///< or device; empty: it is of the scene
};

Result<std::vector<NamedCamera>> take_apart(const std::vector<std::string>& words, const CameraInfo& like) {
  std::vector<NamedCamera> named;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    NamedCamera& each = named.emplace_back(NamedCamera{like, {}});
    each.camera.name = word.substr(0, equals);
    if (equals == std::string::npos) continue;
    each.file = word.substr(equals + 1);
    if (each.file.empty()) return Error{fmt::format("--camera is '{}'; it must be NAME or NAME=FILE", word)};
  }
  return named;
}

#ifdef STEADYHAND_CAMERA
using Source = Result<std::unique_ptr<PictureSource>>;

#ifdef STEADYHAND_RENDER
Source of_scene(const std::vector<CameraInfo>& cameras, Arm& arm, Clock& clock) {
  auto* simulation = dynamic_cast<MujocoArm*>(&arm);
  if (simulation == nullptr) {
    return Error{fmt::format("--camera is '{}'; without =FILE it is a camera of the scene, which only --arm mujoco has",
                             cameras.front().name)};
  }
  return make_scene_cameras(*simulation, cameras, clock);
}
#else
Source of_scene(const std::vector<CameraInfo>&, Arm&, Clock&) {
  return Error{
      "this program was built without cameras of a scene: install libegl-dev and build again with "
      "-DSTEADYHAND_WITH_CAMERA=ON and -DSTEADYHAND_WITH_MUJOCO=ON"};
}
#endif

/// A device of hardware, or a file that plays.
Source of_file(const NamedCamera& each, Clock& clock) {
  std::error_code none;
  if (!std::filesystem::is_character_file(each.file, none)) return open_file_source(each.file, each.camera, clock);
  auto device = open_v4l2_device(each.file);
  if (!device) return device.error();
  return make_v4l2_source(each.file, *std::move(device), each.camera, clock);
}

Result<std::unique_ptr<Cameras>> make_cameras(const std::vector<NamedCamera>& named, Arm& arm, Clock& clock) {
  std::vector<std::unique_ptr<PictureSource>> sources;
  std::vector<CameraInfo> in_scene;
  for (const NamedCamera& each : named) {
    if (each.file.empty()) {
      in_scene.push_back(each.camera);
      continue;
    }
    auto source = of_file(each, clock);
    if (!source) return Error{fmt::format("camera '{}': {}", each.camera.name, source.error().message)};
    sources.push_back(*std::move(source));
  }
  if (!in_scene.empty()) {
    auto source = of_scene(in_scene, arm, clock);
    if (!source) return source.error();
    sources.push_back(*std::move(source));
  }
  auto set = CameraSet::make(std::move(sources), clock);
  if (!set) return set.error();
  return std::unique_ptr<Cameras>(*std::move(set));
}
#else
Result<std::unique_ptr<Cameras>> make_cameras(const std::vector<NamedCamera>&, Arm&, Clock&) {
  return Error{
      "this program was built without cameras: install libavformat-dev, libavcodec-dev and libswscale-dev and build "
      "again with -DSTEADYHAND_WITH_CAMERA=ON"};
}
#endif

}  // namespace

void add_camera_options(CommandLine& command, CameraChoice& choice) {
  command.add_option(
      "--camera", choice.cameras,
      "NAME, a camera of the task's scene, NAME=/dev/videoN, one of hardware, or NAME=FILE, a video file "
      "that plays as a camera; may be given again; none: no camera. Default: those of the task. Size and "
      "rate: settings camera.*");
}

Result<std::unique_ptr<Cameras>> open_cameras(const CameraChoice& choice, const Task& task, const CameraInfo& like,
                                              Arm& arm, Clock& clock, std::string& note) {
  const bool is_asked = !choice.cameras.empty();
  if (choice.cameras == std::vector<std::string>{"none"}) return std::unique_ptr<Cameras>();
  const auto named = take_apart(is_asked ? choice.cameras : task.cameras, like);
  if (!named) return named.error();
  if (named->empty()) return std::unique_ptr<Cameras>();
  auto made = make_cameras(*named, arm, clock);
  if (made || is_asked) return made;
  note = "without the task's cameras: " + made.error().message;
  return std::unique_ptr<Cameras>();
}

}  // namespace steadyhand
