#include "steadyhand/session/supervise/state.hpp"

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

}  // namespace steadyhand
