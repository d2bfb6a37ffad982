#include "steadyhand/arms/ur/ur_modes.hpp"

#include <fmt/format.h>

#include <string>

#include "steadyhand/core/texts.hpp"

namespace steadyhand {

std::string_view why_not(UrRobotMode mode) {
  using enum UrRobotMode;
  static constexpr std::pair<UrRobotMode, std::string_view> kTexts[] = {
      {kRunning, ""},
      {kNoController, "the robot's controller is not connected to its arm"},
      {kDisconnected, "the robot's controller is not connected to its arm"},
      {kConfirmSafety, "the robot waits for its safety configuration to be confirmed on the pendant"},
      {kBooting, "the robot is booting"},
      {kPowerOff, "the robot's power is off: switch it on at the pendant"},
      {kPowerOn, "the robot's brakes are on: release them at the pendant"},
      {kIdle, "the robot's brakes are on: release them at the pendant"},
      {kBackdrive, "the robot is being moved by hand (backdrive)"},
      {kUpdatingFirmware, "the robot is updating its firmware"},
  };
  return text_of(kTexts, mode, "the robot is in a mode that this program does not know");
}

std::string_view why_not(UrSafety safety) {
  using enum UrSafety;
  static constexpr std::pair<UrSafety, std::string_view> kTexts[] = {
      {kNormal, ""},
      {kReduced,
       "the robot is in reduced mode, whose limits of speed this program does not know: leave it (a safety plane, a "
       "safety input or the pendant asks for it)"},
      {kProtectiveStop, "protective stop: see why on the pendant, make room, then unlock it there"},
      {kRecovery, "the robot is in recovery mode: move it inside its safety limits at the pendant"},
      {kSafeguardStop, "safeguard stop: a person is in the protected area, or its reset is pending"},
      {kAutomaticSafeguardStop, "safeguard stop: a person is in the protected area, or its reset is pending"},
      {kSystemEmergencyStop, "emergency stop: release the button and switch the robot on again at the pendant"},
      {kRobotEmergencyStop, "emergency stop: release the button and switch the robot on again at the pendant"},
      {kViolation, "safety violation: see the pendant"},
      {kFault, "the robot's safety system reports a fault: see the pendant"},
      {kValidateJointId, "the robot's joints are to be validated at the pendant"},
      {kThreePositionStop, "the three-position enabling device is released"},
      {kPendantThreePositionStop, "the three-position enabling device is released"},
      {kImmiEmergencyStop, "emergency stop of the injection moulding machine"},
      {kImmiSafeguardStop, "safeguard stop of the injection moulding machine"},
      {kProfisafeWaits, "the robot waits for its PROFIsafe parameters"},
      {kProfisafeAutomaticStop, "safeguard stop over PROFIsafe"},
      {kProfisafeSafeguardStop, "safeguard stop over PROFIsafe"},
      {kProfisafeEmergencyStop, "emergency stop over PROFIsafe"},
      {kSafetyApiStop, "safeguard stop, asked for through the safety API"},
  };
  return text_of(kTexts, safety, "the robot's safety system is in a state that this program does not know");
}

std::string_view why_ended(UrProgramState state) {
  using enum UrProgramState;
  static constexpr std::pair<UrProgramState, std::string_view> kTexts[] = {
      {kSilence, "set-points stopped reaching the controller"},
      {kTooFast, "a set-point stepped, as the controller saw it"},
      {kTooFar, "set-points were too far from the arm's position"},
      {kMoved, "the arm did not follow its program: it was paused and resumed, or its speed was reduced"},
  };
  return text_of(kTexts, state, "the program on the controller ended");
}

RtdeRecipes UrReport::recipes() {
  RtdeRecipes r;
  r.outputs = {{"timestamp", "DOUBLE", {}},
               {"target_q", "VECTOR6D", {}},
               {"actual_q", "VECTOR6D", {}},
               {"actual_qd", "VECTOR6D", {}},
               {"robot_mode", "INT32", {}},
               {"safety_status", "INT32", "safety_mode"},
               {"runtime_state", "UINT32", {}},
               {"speed_scaling", "DOUBLE", {}},
               {"target_speed_fraction", "DOUBLE", {}},
               {"output_int_register_24", "INT32", {}},
               {"output_int_register_25", "INT32", {}},
               {"output_int_register_26", "INT32", {}},
               {"input_int_register_26", "INT32", {}}};
  static_assert(UrRegisters::kState == 24 && UrRegisters::kCycle == 25 && UrRegisters::kOwner == 26);
  static const auto kDoubles = [] {
    std::array<std::string, 18> names;
    for (int i = 0; i < std::ssize(names); ++i) names[i] = fmt::format("input_double_register_{}", 24 + i);
    return names;
  }();
  static_assert(UrRegisters::kQ == 24 && UrRegisters::kDq == 30 && UrRegisters::kDdq == 36);
  for (const std::string_view name : kDoubles) r.inputs.push_back({name, "DOUBLE", {}});
  static_assert(UrRegisters::kAnswers == 24 && UrRegisters::kMode == 25 && UrRegisters::kSession == 26);
  for (const char* name : {"input_int_register_24", "input_int_register_25", "input_int_register_26"}) {
    r.inputs.push_back({name, "INT32", {}});
  }
  return r;
}

void UrReport::read(RtdeReader& data) {
  timestamp = data.take<double>();
  for (auto* joints : {&target_q, &q, &dq}) {
    for (double& value : *joints) value = data.take<double>();
  }
  mode = static_cast<UrRobotMode>(data.take<std::int32_t>());
  safety = static_cast<UrSafety>(data.take<std::int32_t>());
  runtime = static_cast<UrRuntime>(data.take<std::uint32_t>());
  scaling = data.take<double>();
  slider = data.take<double>();
  program = static_cast<UrProgramState>(data.take<std::int32_t>());
  cycle = data.take<std::int32_t>();
  owner = data.take<std::int32_t>();
  addressed = data.take<std::int32_t>();
}

}  // namespace steadyhand
