#include "steadyhand/arms/ur/ur_modes.hpp"

namespace steadyhand {

std::string_view why_not(UrRobotMode mode) {
  switch (mode) {
    case UrRobotMode::kRunning:
      return "";
    case UrRobotMode::kNoController:
    case UrRobotMode::kDisconnected:
      return "the robot's controller is not connected to its arm";
    case UrRobotMode::kConfirmSafety:
      return "the robot waits for its safety configuration to be confirmed on the pendant";
    case UrRobotMode::kBooting:
      return "the robot is booting";
    case UrRobotMode::kPowerOff:
      return "the robot's power is off: switch it on at the pendant";
    case UrRobotMode::kPowerOn:
    case UrRobotMode::kIdle:
      return "the robot's brakes are on: release them at the pendant";
    case UrRobotMode::kBackdrive:
      return "the robot is being moved by hand (backdrive)";
    case UrRobotMode::kUpdatingFirmware:
      return "the robot is updating its firmware";
  }
  return "the robot is in a mode that this program does not know";
}

std::string_view why_not(UrSafety safety) {
  switch (safety) {
    case UrSafety::kNormal:
      return "";
    case UrSafety::kReduced:
      return "the robot is in reduced mode, whose limits of speed this program does not know: leave it (a safety "
             "plane, a "
             "safety input or the pendant asks for it)";
    case UrSafety::kProtectiveStop:
      return "protective stop: see why on the pendant, make room, then unlock it there";
    case UrSafety::kRecovery:
      return "the robot is in recovery mode: move it inside its safety limits at the pendant";
    case UrSafety::kSafeguardStop:
    case UrSafety::kAutomaticSafeguardStop:
      return "safeguard stop: somebody is in the way, or its reset is pending";
    case UrSafety::kSystemEmergencyStop:
    case UrSafety::kRobotEmergencyStop:
      return "emergency stop: release the button and switch the robot on again at the pendant";
    case UrSafety::kViolation:
      return "safety violation: see the pendant";
    case UrSafety::kFault:
      return "the robot's safety system reports a fault: see the pendant";
    case UrSafety::kValidateJointId:
      return "the robot's joints are to be validated at the pendant";
    case UrSafety::kThreePositionStop:
    case UrSafety::kPendantThreePositionStop:
      return "the three-position enabling device is released";
    case UrSafety::kImmiEmergencyStop:
      return "emergency stop of the injection moulding machine";
    case UrSafety::kImmiSafeguardStop:
      return "safeguard stop of the injection moulding machine";
    case UrSafety::kProfisafeWaits:
      return "the robot waits for its PROFIsafe parameters";
    case UrSafety::kProfisafeAutomaticStop:
    case UrSafety::kProfisafeSafeguardStop:
      return "safeguard stop over PROFIsafe";
    case UrSafety::kProfisafeEmergencyStop:
      return "emergency stop over PROFIsafe";
    case UrSafety::kSafetyApiStop:
      return "safeguard stop, asked for through the safety API";
    case UrSafety::kUndefined:
      break;
  }
  return "the robot's safety system is in a state that this program does not know";
}

}  // namespace steadyhand
