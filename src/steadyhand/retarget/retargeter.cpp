#include "steadyhand/retarget/retargeter.hpp"

#include <algorithm>
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
  target.look_ahead = sample.look_ahead;
  target.engaged = follows(sample);
  if (target.engaged != engaged_ || !latched_) {
    X_operator_hand0_ = sample.X_operator_hand;
    X_base_tool0_ = X_base_tool_now;
    latched_ = true;
  }
  if (target.engaged && !engaged_) engaged_at_ = sample.stamp.hand;
  target.X_base_tool = X_base_tool0_;
  if (target.engaged && engaged_) {
    const double elapsed = to_seconds(sample.stamp.hand - engaged_at_);
    const double share = elapsed < settings_.ramp ? std::max(0.0, elapsed / settings_.ramp) : 1.0;
    target.X_base_tool = moved_tool(sample.X_operator_hand, share);
    if (share < 1.0) {
      X_operator_hand0_ = sample.X_operator_hand;
      X_base_tool0_ = target.X_base_tool;
    }
  }
  engaged_ = target.engaged;
  if (target.engaged) X_operator_hand_ = sample.X_operator_hand;
  X_base_target_ = target.X_base_tool;
  return target;
}

void Retargeter::latch_newest() {
  X_operator_hand0_ = X_operator_hand_;
  X_base_tool0_ = X_base_target_;
}

void Retargeter::set_scale(double scale) {
  if (scale == settings_.scale) return;
  latch_newest();
  settings_.scale = scale;
}

void Retargeter::set_yaw(double yaw) {
  if (yaw == settings_.yaw) return;
  latch_newest();
  settings_.yaw = yaw;
  q_base_operator_ = Eigen::AngleAxisd(yaw, Vector3::UnitZ());
}

Pose Retargeter::moved_tool(const Pose& hand, double share) const {
  const auto part = [&](const Quaternion& q) { return share < 1.0 ? Quaternion::Identity().slerp(share, q) : q; };
  const Pose& hand0 = X_operator_hand0_;
  const Pose& tool0 = X_base_tool0_;
  const Quaternion q_tool0_hand0 = tool0.q * hand0.q.conjugate();
  Pose tool;

  const bool base_moves = settings_.translation_frame == MotionFrame::kBase;
  const Quaternion& turn = base_moves ? q_base_operator_ : q_tool0_hand0;
  tool.p = tool0.p + share * settings_.scale * (turn * (hand.p - hand0.p));

  const bool base_turns = settings_.rotation_frame == MotionFrame::kBase;
  const Quaternion q =
      base_turns ? q_base_operator_ * part(hand.q * hand0.q.conjugate()) * q_base_operator_.conjugate() * tool0.q
                 : tool0.q * part(hand0.q.conjugate() * hand.q);
  tool.q = q.normalized();
  return tool;
}

}  // namespace steadyhand
