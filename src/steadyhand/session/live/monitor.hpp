#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"

namespace steadyhand {

/// What the whole session's commands and measured motion came to. Whatever is more than rounding counts, and by how
/// much is told.
struct MonitorResult {
  std::uint64_t commands = 0, states = 0;
  /// Commands out of the model's limits of position, speed or acceleration, by their own word or by what became of them
  /// from one to the next, however long that took.
  std::uint64_t beyond_limits = 0;
  std::uint64_t too_fast = 0;    ///< measured states beyond a speed limit
  std::uint64_t in_contact = 0;  ///< commands that let a pair of bodies overlap
  // ---- the most by which anything was beyond a limit, 0: nothing was
  double position_excess = 0.0;      ///< rad (m)
  double speed_excess = 0.0;         ///< rad/s (m/s)
  double acceleration_excess = 0.0;  ///< rad/s^2 (m/s^2)
  double step = 0.0;                 ///< rad (m): of a command, beyond where those accelerations lead
  double measured_excess = 0.0;      ///< rad/s (m/s), of measured speed
  double smallest_clearance = std::numeric_limits<double>::infinity();  ///< m, over all commands; < 0: overlap
  std::array<std::string, 2> nearest;  ///< names of the pair of bodies at that, what is carried included
  // ---- of obstacles, without their margins, and the bodies that must not touch them
  std::uint64_t touching = 0;                                          ///< commands that let any overlap
  double smallest_distance = std::numeric_limits<double>::infinity();  ///< m, over all commands; < 0: overlap
  std::string nearest_body;      ///< its name, at that; empty: there was no obstacle
  std::string nearest_obstacle;  ///< likewise
};
/// In two lines or more, for people.
std::string to_text(const MonitorResult& result);

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
