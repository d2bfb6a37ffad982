#pragma once

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// Axes in which the hand's motion since engagement is applied to the tool.
enum class MotionFrame {
  kBase,  ///< axes of the room: operator's axes, turned by yaw, are the base's
  kTool,  ///< axes of the held object: the hand's axes at engagement are the tool's at engagement
};

/// s, RetargetSettings::ramp of live sessions.
inline constexpr double kLiveRamp = 0.5;

/// How the hand's motion is mapped to the tool.
struct RetargetSettings {
  /// Metres of the tool per metre of the hand; > 0. Half, because people walk about and the arm does not.
  double scale = 0.5;
  /// Turn of the operator's axes about base z, rad. By default the operator's left is the arm's forward and their
  /// forward the arm's right: the most frequent hand motions then stay away from the base axis.
  double yaw = -M_PI / 2;
  MotionFrame translation_frame = MotionFrame::kBase;  ///< axes of the hand's displacement
  MotionFrame rotation_frame = MotionFrame::kBase;     ///< axes of its rotation
  /// s after engagement in which the share of the hand's motion that the tool follows grows from 0 to all; what it did
  /// not follow is left behind, as by a clutch. 0: follow at once.
  double ramp = 0.0;
  /// rad: how far the target's z axis may lean from the vertical, 0 to pi. A larger lean of the hand is limited; its
  /// rotation about the vertical is kept. 0: upright. pi: the hand may pour.
  double tilt_max = M_PI;
  bool accept_emulated = false;  ///< follow poses whose position the headset guesses (WebXR emulatedPosition)
};

/// Hand to tool, relative to the poses at engagement: clutch, frames, scale and the gate for poses that cannot be
/// trusted. With h the hand, e the tool, 0 the moment of engagement, C = Rz(yaw) and s the scale:
///
///   translation  kBase  p = p_e0 + s C (p_h - p_h0)             kTool  p = p_e0 + s R_e0 R_h0' (p_h - p_h0)
///   rotation     kBase  R = C (R_h R_h0') C' R_e0               kTool  R = R_e0 R_h0' R_h
///
/// A policy's poses are those of the tool in the base, and scale, axes and frames mean nothing for them. With B the
/// policy's pose and b, from 0 to 1 by a smooth step (3 x^2 - 2 x^3) within the time that the way from e_0 takes at
/// kBlendSpeed and kBlendTurnRate, and the ramp's at least:
///
///   p = p_e0 + b (p_B - p_e0)                               R = R_e0 slerp(b, R_e0' R_B)
///
/// Engaging therefore never steps the target, for any poses of hand and tool. During the ramp it moves by growing
/// shares of the hand's steps from sample to sample. Allocates nothing; one thread.
class Retargeter {
 public:
  /// Not engaged.
  explicit Retargeter(const RetargetSettings& settings = {});

  /// Every sample in order of time. X_base_tool_now: where the tool is (or its plan has it), which becomes the target
  /// at engagement and at release, and stays it until the next engagement. Not engaged are samples without clutch,
  /// without tracking, with an emulated position unless accepted, and with numbers that are not finite; the first good
  /// sample after them engages again.
  Target update(const OperatorSample& sample, const Pose& X_base_tool_now);

  /// Releases: the next good sample engages again.
  void release() { engaged_ = false; }

  /// For later motion: the target does not step. @param scale > 0
  void set_scale(double scale);
  void set_yaw(double yaw);  ///< rad
  /// rad. The target moves to a new limit at no more than a radian per second.
  void set_tilt_max(double tilt) { settings_.tilt_max = tilt; }

  static constexpr double kBlendSpeed = 0.25;    ///< m/s
  static constexpr double kBlendTurnRate = 1.0;  ///< rad/s

 private:
  Pose blended(const Pose& X_base_policy, Time now) const;
  void latch_newest();
  bool follows(const OperatorSample& sample) const;
  /// Tool pose for the hand, from the latched poses; `share` of the motion.
  Pose moved_tool(const Pose& X_operator_hand, double share) const;
  Quaternion righted(const Quaternion& q, Time now);

  RetargetSettings settings_;
  Quaternion q_base_operator_;
  bool engaged_ = false, latched_ = false;
  Leader leader_ = Leader::kPerson;
  double blend_ = 0.0;  ///< s after engagement, until a policy's poses are followed as they are
  Time engaged_at_{0};
  double tilt_max_ = M_PI;                ///< rad, in force now
  Time tilted_at_{0};                     ///< time of its last update
  Pose X_operator_hand_, X_base_target_;  ///< newest
  Pose X_operator_hand0_, X_base_tool0_;  ///< at the last engagement or release; while the ramp lasts, one sample ago
};

/// The inverse: where the hand has to be for the tool to be at X_base_tool, if they were at X_operator_hand0 and
/// X_base_tool0 at engagement. With neither a ramp nor a limit of tilt.
Pose hand_for(const RetargetSettings& settings, const Pose& X_base_tool, const Pose& X_base_tool0,
              const Pose& X_operator_hand0);

}  // namespace steadyhand
