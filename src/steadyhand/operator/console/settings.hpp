#pragma once

#include <string>

#include "steadyhand/arms/driver/arm_kinds.hpp"
#include "steadyhand/arms/driver/mujoco_settings.hpp"
#include "steadyhand/arms/driver/ros2_settings.hpp"
#include "steadyhand/arms/driver/simulated_arm.hpp"
#include "steadyhand/arms/driver/ur_settings.hpp"
#include "steadyhand/core/video.hpp"
#include "steadyhand/files/archive/recording_folder.hpp"
#include "steadyhand/files/archive/session_recorder.hpp"
#include "steadyhand/files/config/settings_table.hpp"
#include "steadyhand/operator/server/server.hpp"
#include "steadyhand/session/live/live_session.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// Everything that one YAML file, or the command line, may set of a live session. Must stay where it is while a table
/// describes it.
struct SessionSettings {
  std::string robot = "ur5e", profile = "carry", cell = "pedestal";
  std::string task_name = "none";
  std::string solver = "profile";         ///< a solver's name, or the profile's own
  std::string arm_kind{kSimulated.name};  ///< of kArmKinds
  std::string arm_host;                   ///< for kinds that have a host
  std::string translation_frame = "base", rotation_frame = "base";
  std::string recording_folder = default_session_folder().string();
  LiveSettings live;
  Task task;                     ///< read by its name later
  std::string contact = "stop";  ///< name of a ContactPolicy
  SimulatedArmSettings arm;
  MujocoSettings mujoco;
  CameraInfo camera;  ///< size and rate of each
  Ros2Settings ros2;
  UrSettings ur;
  ServerSettings server;
  RecordingSettings recording;
  RecordingFolderSettings recording_place;

  SessionSettings();

  /// Completes dependent settings, once everything is set. Refuses settings that contradict each other,
  /// with the origins that the table knows.
  Status resolve(const SettingsTable& table);
};

/// A name, unit and range for each.
SettingsTable describe(SessionSettings& settings);

}  // namespace steadyhand
