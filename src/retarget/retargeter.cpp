#include "retarget/retargeter.hpp"

#include <cmath>

namespace steadyhand {

Retargeter::Retargeter(const RetargetSettings& settings)
    : settings_(settings), q_base_operator_(Eigen::AngleAxisd(settings.yaw, Vector3::UnitZ())) {}

bool Retargeter::follows(const OperatorSample& sample) const {
  const Pose& X = sample.X_operator_hand;
  return sample.clutch && sample.tracked && (!sample.emulated || settings_.accept_emulated) && X.p.allFinite() &&
         std::abs(X.q.squaredNorm() - 1.0) < 1e-3;  // false for NaN
}

Target Retargeter::update(const OperatorSample& sample, const Pose& X_base_tool_now) {
  Target target;
  target.stamp = sample.stamp;
  target.engaged = follows(sample);
  if (target.engaged != engaged_ || !latched_) {
    X_operator_hand0_ = sample.X_operator_hand;
    X_base_tool0_ = X_base_tool_now;
    latched_ = true;
  }
  target.X_base_tool = X_base_tool0_;
  if (target.engaged && engaged_) {
    const Pose& hand = sample.X_operator_hand;
    const Pose& hand0 = X_operator_hand0_;
    const Pose& tool0 = X_base_tool0_;
    const Quaternion q_tool0_hand0 = tool0.q * hand0.q.conjugate();

    const bool base_moves = settings_.translation_frame == MotionFrame::kBase;
    const Quaternion& turn = base_moves ? q_base_operator_ : q_tool0_hand0;
    target.X_base_tool.p = tool0.p + settings_.scale * (turn * (hand.p - hand0.p));

    const bool base_turns = settings_.rotation_frame == MotionFrame::kBase;
    const Quaternion q = base_turns
                             ? q_base_operator_ * hand.q * hand0.q.conjugate() * q_base_operator_.conjugate() * tool0.q
                             : q_tool0_hand0 * hand.q;
    target.X_base_tool.q = q.normalized();
  }
  engaged_ = target.engaged;
  return target;
}

}  // namespace steadyhand
