#pragma once

#include <filesystem>
#include <string>

#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/operator/console/stop_signals.hpp"

namespace steadyhand {

/// The steps in which an arm is taken into service; each does what the one before does not.
enum class Stage {
  kRead,   ///< nothing moves, no program
  kHold,   ///< our program holds the arm where it stands
  kSlow,   ///< back and forth by 0.1 rad, at 5 % of speed and acceleration
  kEmpty,  ///< by 0.2 rad at 25 %, with the empty glass
  kGlass   ///< by 0.2 rad at 10 %, with liquid
};

struct StageMotion {
  double way = 0.0;            ///< rad, of each joint, back and forth
  double speed_scaling = 0.0;  ///< largest share of the model's speeds and accelerations
};
StageMotion motion_of(Stage stage);

/// A stage remembers every state.
constexpr double kLongestStage = 600.0;  // s

struct StageReport {
  std::string stopped;                 ///< why the arm did, or who interrupted; empty: the stage ran to its end
  double seconds = 0.0;                ///< that it followed
  std::uint64_t cycles = 0, late = 0;  ///< control cycles, and those that this program missed
  double jitter = 0.0;                 ///< s, largest difference of two states' distance from a whole cycle
  double stray = 0.0;                  ///< rad, most of any joint from where it was commanded, its delay regarded
  double delay = 0.0;                  ///< s, from a command to its effect, best fit; 0 without motion
};

/// Whether the stage's motion from here keeps the limits and the arm apart from itself; what is wrong, if not.
Status check_stage(Stage stage, const RobotModel& model, const JointVector& q);
/// Waits until the arm follows, runs the stage for `seconds`, and stops the arm where it started. A signal stops it
/// where it is, no faster than the stage moves it.
StageReport run_stage(Stage stage, Arm& arm, const RobotModel& model, double seconds, const StopSignals& signals);

/// Puts `key: value` (SECTION.NAME) into a settings file, which it makes if it is not there, and leaves all else as it
/// is. Fails, and changes nothing, if it cannot be written whole or would not be read so.
Status write_setting(const std::filesystem::path& file, const std::string& key, const std::string& value);

}  // namespace steadyhand
