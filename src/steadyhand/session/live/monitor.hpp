#pragma once

#include <string>
#include <vector>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/session/live/live_taps.hpp"

namespace steadyhand {

/// Looks at every command and every measured state, away from the control loop, and knows nothing of plans: an
/// independent witness of what the session did. It also carries the liquid, driven by the glass as measured; a gripper
/// has none. One thread.
class Monitor {
 public:
  /// The model must outlive it.
  Monitor(const RobotModel& model, const GlassSettings& glass);

  /// @param anew the arm was restarted where it stands: the command need not continue those before
  void update(const JointCommand& command, bool anew = false);
  void update(const JointState& state);
  /// From the next command on. @param names of the obstacles, for people
  void set_obstacles(const Obstacles& obstacles, std::vector<std::string> names);
  /// Fresh, and at rest in the glass as it leans now.
  void reset_liquid() { liquid_.reset(measured_.R().transpose() * kGravity); }
  /// m, of fresh liquid.
  void fill(double height);

  /// For people, a line for each obstacle that the arm is in, as it was measured last.
  std::vector<std::string> overlaps() const;

  const Obstacles& obstacles() const { return obstacles_; }
  const MonitorResult& result() const { return result_; }
  const LiquidState& liquid() const { return liquid_.state(); }
  /// Of the newest measured state, glass frame, m/s^2.
  const Vector3& local_acceleration() const { return local_acceleration_; }
  /// At the newest measured state.
  const Kinematics& arm() const { return measured_; }

 private:
  void look_at_obstacles(Time now);
  const std::string& name(int solid) const;

  Kinematics commanded_, measured_;
  Obstacles obstacles_;
  std::vector<std::string> names_;
  GlassSettings glass_;
  Liquid liquid_;
  MonitorResult result_;
  JointCommand last_command_;
  Time last_state_{0};
  Vector3 last_velocity_ = Vector3::Zero(), local_acceleration_ = kGravity;
};

}  // namespace steadyhand
