#include "steadyhand/core/live.hpp"

namespace steadyhand {

std::string_view to_string(SupervisionState state) {
  switch (state) {
    case SupervisionState::kIdle:
      return "idle";
    case SupervisionState::kReady:
      return "ready";
    case SupervisionState::kEngaged:
      return "engaged";
    case SupervisionState::kHolding:
      return "holding";
    case SupervisionState::kStopping:
      return "stopping";
    case SupervisionState::kFault:
      return "fault";
  }
  return "unknown";
}

std::string_view to_string(ConstraintKind kind) {
  switch (kind) {
    case ConstraintKind::kNone:
      return "none";
    case ConstraintKind::kPosition:
      return "position";
    case ConstraintKind::kVelocity:
      return "velocity";
    case ConstraintKind::kAcceleration:
      return "acceleration";
    case ConstraintKind::kSelfCollision:
      return "self_collision";
    case ConstraintKind::kReach:
      return "reach";
  }
  return "unknown";
}

}  // namespace steadyhand
