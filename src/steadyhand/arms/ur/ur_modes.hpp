#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "steadyhand/arms/ur/rtde_client.hpp"
#include "steadyhand/arms/ur/ur_program.hpp"

namespace steadyhand {

/// robot_mode of RTDE. Only in kRunning do the joints obey.
enum class UrRobotMode : std::int32_t {
  kNoController = -1,
  kDisconnected = 0,
  kConfirmSafety = 1,
  kBooting = 2,
  kPowerOff = 3,
  kPowerOn = 4,
  kIdle = 5,
  kBackdrive = 6,
  kRunning = 7,
  kUpdatingFirmware = 8,
};

/// safety_status of RTDE (software 3.10 and 5.4 on), whose first ten are also safety_mode's. Those beyond 13 came with
/// later software; the names are those of UR's client library.
enum class UrSafety : std::int32_t {
  kNormal = 1,
  kReduced = 2,
  kProtectiveStop = 3,
  kRecovery = 4,
  kSafeguardStop = 5,
  kSystemEmergencyStop = 6,
  kRobotEmergencyStop = 7,
  kViolation = 8,
  kFault = 9,
  kValidateJointId = 10,
  kUndefined = 11,
  kAutomaticSafeguardStop = 12,
  kThreePositionStop = 13,
  kPendantThreePositionStop = 14,
  kImmiEmergencyStop = 15,  ///< from an injection moulding machine; the next too
  kImmiSafeguardStop = 16,
  kProfisafeWaits = 17,
  kProfisafeAutomaticStop = 18,
  kProfisafeSafeguardStop = 19,
  kProfisafeEmergencyStop = 20,
  kSafetyApiStop = 22,
};

/// runtime_state of RTDE: of the controller's one program.
enum class UrRuntime : std::uint32_t {
  kStopping = 0,
  kStopped = 1,
  kPlaying = 2,
  kPausing = 3,
  kPaused = 4,
  kResuming = 5,
};

/// Bits of robot_status_bits.
inline constexpr std::uint32_t kUrPowerOn = 1u << 0, kUrProgramRunning = 1u << 1;

/// Why the arm cannot move, in a whole clause that says what to do; empty if it can. Static text.
std::string_view why_not(UrRobotMode mode);
std::string_view why_not(UrSafety safety);
/// Why the program on the controller has ended. Static text.
std::string_view why_ended(UrProgramState state);

/// State that the controller reports over RTDE: the output recipe's variables.
struct UrReport {
  double timestamp = 0.0;  ///< s, of the controller
  std::array<double, 6> target_q{}, q{}, dq{};
  UrRobotMode mode = UrRobotMode::kNoController;
  UrSafety safety = UrSafety::kUndefined;
  UrRuntime runtime = UrRuntime::kStopped;
  double scaling = 1.0, slider = 1.0;  ///< shares of the speed
  UrProgramState program = UrProgramState::kNone;
  std::int32_t cycle = 0, owner = 0;  ///< of our program
  std::int32_t addressed = 0;         ///< whose the set-points in the registers are

  static RtdeRecipes recipes();
  void read(RtdeReader& data);
  bool playing() const { return runtime == UrRuntime::kPlaying; }
};

}  // namespace steadyhand
