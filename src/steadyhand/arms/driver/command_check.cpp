#include "steadyhand/arms/driver/command_check.hpp"

#include <algorithm>

namespace steadyhand {

namespace {

/// How far a command may exceed a limit, to allow for rounding at its source.
constexpr double kPositionMargin = 1e-4;                           // rad (m)
constexpr double kSpeedMargin = 0.01, kAccelerationMargin = 0.05;  // shares
/// Most from the arm's position to the first command.
constexpr double kFirstStep = 0.01;  // rad (m)

}  // namespace

std::string_view CommandCheck::refusal(const JointCommand& command, const JointVector& q) {
  const std::string_view why = judge(command, q);
  if (why.empty()) take(command);
  return why;
}

void CommandCheck::take(const JointCommand& command) {
  before_ = last_;
  last_ = command;
  received_ = std::min(received_ + 1, 2);
}

std::string_view CommandCheck::judge(const JointCommand& c, const JointVector& q) const {
  if (c.q.size() != q.size() || c.dq.size() != q.size() || !c.q.allFinite() || !c.dq.allFinite()) {
    return "a command is not finite";
  }
  if (((c.q - model_->position_max).array() > kPositionMargin).any() ||
      ((model_->position_min - c.q).array() > kPositionMargin).any()) {
    return "a command is beyond a position limit";
  }
  if (received_ == 0) return (c.q - q).cwiseAbs().maxCoeff() > kFirstStep ? "a command steps" : "";
  const double dt = to_seconds(c.stamp.made - last_.stamp.made);
  if (dt <= 0.0) return "commands are out of order";
  const JointVector speed = (c.q - last_.q) / dt;
  if ((speed.cwiseAbs() - (1.0 + kSpeedMargin) * model_->velocity_max).maxCoeff() > 0.0) {
    return "a command is beyond a velocity limit";
  }
  if (received_ == 1) return "";
  const double dt_before = to_seconds(last_.stamp.made - before_.stamp.made);
  const JointVector change = speed - (last_.q - before_.q) / dt_before;
  const double span = 0.5 * (dt + dt_before);  // between the middles of the two differences
  if ((change.cwiseAbs() / span - (1.0 + kAccelerationMargin) * model_->acceleration_max).maxCoeff() > 0.5) {
    return "a command is beyond an acceleration limit";
  }
  return "";
}

}  // namespace steadyhand
