#pragma once

#include <string>
#include <vector>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/session/live/live_taps.hpp"

namespace steadyhand {

/// Independent monitor: checks every command and every measured state, outside the control loop and without knowledge
/// of plans. It also simulates the liquid, driven by the measured motion of the glass; a gripper has none. One thread.
class Monitor {
 public:
  /// The model must outlive it.
  Monitor(const RobotModel& model, const GlassSettings& glass);

  /// @param anew the arm was restarted where it is: the command need not continue the one before
  void update(const JointCommand& command, bool anew = false);
  void update(const JointState& state);
  /// Applies from the next command on. @param names of the obstacles, for people
  void set_obstacles(const Obstacles& obstacles, std::vector<std::string> names);
  /// Refills the glass; the liquid is at rest in the glass as it leans now.
  void reset_liquid() { liquid_.reset(measured_.R().transpose() * kGravity); }
  /// Refills the glass to this height, m.
  void fill(double height);

  /// One line for each obstacle that the arm touches as last measured, for people.
  std::vector<std::string> overlaps() const;

  const Obstacles& obstacles() const { return obstacles_; }
  const MonitorResult& result() const { return result_; }
  const LiquidState& liquid() const { return liquid_.state(); }
  /// Specific force at the newest measured state, glass frame, m/s^2.
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
