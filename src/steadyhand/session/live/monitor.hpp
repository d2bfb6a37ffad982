#pragma once

#include <string>
#include <vector>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/session/live/live_taps.hpp"

namespace steadyhand {

/// Independent monitor: checks every command and every measured state, outside the control loop and without knowledge
/// of plans. It also simulates the liquid of each tool, driven by the measured motion of the glass; a gripper has none.
/// One thread.
class Monitor {
 public:
  /// The model must outlive it.
  Monitor(const RobotModel& model, const GlassSettings& glass);

  /// @param anew the arm was restarted where it is: the command need not continue the one before
  void update(const JointCommand& command, bool anew = false);
  void update(const JointState& state);
  /// Applies from the next command on. @param names of the obstacles, for people
  void set_obstacles(const Obstacles& obstacles, std::vector<std::string> names);
  /// Refills a tool's glass; the liquid is at rest in the glass as it leans now.
  void reset_liquid(int tool = 0) { glasses_[tool].liquid.reset(measured_.R(tool).transpose() * kGravity); }
  /// Refills all glasses to this height, m.
  void fill(double height);

  /// One line for each obstacle that the arm touches as last measured, for people.
  std::vector<std::string> overlaps() const;

  const Obstacles& obstacles() const { return obstacles_; }
  const MonitorResult& result() const { return result_; }
  const LiquidState& liquid(int tool = 0) const { return glasses_[tool].liquid.state(); }
  bool spilled() const;  ///< any of the liquids
  /// Specific force at the newest measured state, glass frame, m/s^2.
  const Vector3& local_acceleration(int tool = 0) const { return glasses_[tool].local_acceleration; }
  /// At the newest measured state.
  const Kinematics& arm() const { return measured_; }

 private:
  void look_at_obstacles(Time now);
  const std::string& name(int solid) const;

  Kinematics commanded_, measured_;
  Obstacles obstacles_;
  std::vector<std::string> names_;
  GlassSettings glass_;
  /// Of a tool.
  struct Glass {
    Liquid liquid;
    Vector3 last_velocity = Vector3::Zero(), local_acceleration = kGravity;
  };
  std::vector<Glass> glasses_;
  MonitorResult result_;
  JointCommand last_command_;
  Time last_state_{0};
};

}  // namespace steadyhand
