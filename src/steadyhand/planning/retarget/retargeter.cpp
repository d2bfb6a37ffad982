#include "steadyhand/planning/retarget/retargeter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace steadyhand {

namespace {

/// rad, from the base's z to that of a frame.
double lean(const Quaternion& q) {
  const Vector3 axis = q * Vector3::UnitZ();
  return std::atan2(axis.head<2>().norm(), axis.z());
}

}  // namespace

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
  target.leader = sample.leader;
  target.tool = sample.tool;
  target.engaged = follows(sample);
  if (std::exchange(leader_, sample.leader) != sample.leader) engaged_ = false;
  if (target.engaged != engaged_ || !latched_) {
    X_operator_hand0_ = sample.X_operator_hand;
    X_base_tool0_ = X_base_tool_now;
    latched_ = true;
  }
  const bool policy = sample.leader == Leader::kPolicy;
  if (target.engaged && !engaged_) {
    engaged_at_ = sample.stamp.hand;
    const Pose& to = sample.X_operator_hand;
    if (policy) {
      blend_ = std::max({settings_.ramp, 1.5 * (to.p - X_base_tool_now.p).norm() / kBlendSpeed,
                         1.5 * to.q.angularDistance(X_base_tool_now.q) / kBlendTurnRate});
    }
  }
  target.X_base_tool = X_base_tool0_;
  if (target.engaged && engaged_) {
    const double elapsed = to_seconds(sample.stamp.hand - engaged_at_);
    const double ramped = elapsed < settings_.ramp ? std::max(0.0, elapsed / settings_.ramp) : 1.0;
    const double share = policy ? 1.0 : ramped;
    target.X_base_tool =
        policy ? blended(sample.X_operator_hand, sample.stamp.hand) : moved_tool(sample.X_operator_hand, share);
    const Quaternion as_the_hand = target.X_base_tool.q;
    target.X_base_tool.q = righted(as_the_hand, sample.stamp.hand);
    if (share < 1.0) {
      X_operator_hand0_ = sample.X_operator_hand;
      X_base_tool0_ = {target.X_base_tool.p, as_the_hand};
    }
  } else if (target.engaged) {
    tilt_max_ = std::max(settings_.tilt_max, lean(X_base_tool_now.q));  // from where the tool is it does not jump
    tilted_at_ = sample.stamp.hand;
  }
  engaged_ = target.engaged;
  if (target.engaged) X_operator_hand_ = sample.X_operator_hand;
  X_base_target_ = target.X_base_tool;
  return target;
}

void Retargeter::latch_newest() {
  if (engaged_ && leader_ == Leader::kPolicy) return;  // scale and axes do not apply to a policy
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

/// q, rotated back about a horizontal axis until it is within tilt_max.
Quaternion Retargeter::righted(const Quaternion& q, Time now) {
  constexpr double kRate = 1.0;  // rad/s
  const double angle = lean(q), way = kRate * std::max(0.0, to_seconds(now - tilted_at_));
  tilted_at_ = now;
  // If the limit allows more than the hand's lean, it is set to that lean and decreases from there.
  const double from = std::min(tilt_max_, std::max(angle, settings_.tilt_max));
  tilt_max_ = std::clamp(settings_.tilt_max, from - way, from + way);
  if (angle <= tilt_max_) return q;
  const Vector3 axis = q * Vector3::UnitZ();
  const Vector3 level = axis.cross(Vector3::UnitZ());
  if (level.norm() < 1e-6) return q;  // upside down: no direction is the shortest
  return (Quaternion(Eigen::AngleAxisd(angle - tilt_max_, level.normalized())) * q).normalized();
}

/// Blend from the tool's pose at engagement to the policy's pose.
Pose Retargeter::blended(const Pose& X_base_policy, Time now) const {
  const double elapsed = std::max(0.0, to_seconds(now - engaged_at_));
  if (elapsed >= blend_) return X_base_policy;
  const double x = elapsed / blend_, part = x * x * (3.0 - 2.0 * x);
  return {X_base_tool0_.p + part * (X_base_policy.p - X_base_tool0_.p),
          X_base_tool0_.q.slerp(part, X_base_policy.q).normalized()};
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

Pose hand_for(const RetargetSettings& settings, const Pose& X_base_tool, const Pose& X_base_tool0,
              const Pose& X_operator_hand0) {
  const Pose &tool = X_base_tool, &tool0 = X_base_tool0, &hand0 = X_operator_hand0;
  const Quaternion q_base_operator(Eigen::AngleAxisd(settings.yaw, Vector3::UnitZ()));
  const bool base_moves = settings.translation_frame == MotionFrame::kBase;
  const Quaternion turn = base_moves ? q_base_operator : tool0.q * hand0.q.conjugate();
  const bool base_turns = settings.rotation_frame == MotionFrame::kBase;
  const Quaternion q = base_turns
                           ? q_base_operator.conjugate() * tool.q * tool0.q.conjugate() * q_base_operator * hand0.q
                           : hand0.q * tool0.q.conjugate() * tool.q;
  return {hand0.p + turn.conjugate() * (tool.p - tool0.p) / settings.scale, q.normalized()};
}

}  // namespace steadyhand
