#pragma once

#include <limits>

#include "arm/liquid.hpp"
#include "robot/kinematics.hpp"

namespace steadyhand {

/// What the whole session's commands and measured motion came to.
struct MonitorResult {
  std::uint64_t commands = 0, states = 0;
  std::uint64_t beyond_limits = 0;  ///< commands out of the model's position, velocity or acceleration limits
  std::uint64_t in_contact = 0;  ///< commands that let a pair of spheres overlap by more than plans may between nodes
  double smallest_clearance = std::numeric_limits<double>::infinity();  ///< m, over all commands
  std::array<int, 2> nearest{-1, -1};                                   ///< pair of spheres at that
};

/// Looks at every command and every measured state, away from the control loop, and knows nothing of plans: an
/// independent witness of what the session did. It also carries the liquid, driven by the glass as measured. One
/// thread.
class Monitor {
 public:
  /// The model must outlive it.
  Monitor(const RobotModel& model, const GlassSettings& glass);

  void update(const JointCommand& command);
  void update(const JointState& state);
  void reset_liquid() { liquid_.reset(); }

  const MonitorResult& result() const { return result_; }
  const LiquidState& liquid() const { return liquid_.state(); }
  /// Of the newest measured state, glass frame, m/s^2.
  const Vector3& local_acceleration() const { return local_acceleration_; }
  /// At the newest measured state.
  const Kinematics& arm() const { return measured_; }

 private:
  Kinematics commanded_, measured_;
  Liquid liquid_;
  MonitorResult result_;
  JointCommand last_command_;
  Time last_state_{0};
  Vector3 last_velocity_ = Vector3::Zero(), local_acceleration_ = kGravity;
};

/// The pair of spheres with the smallest gap, and that gap in m; {-1, -1} and infinity without pairs.
struct NearestPair {
  std::array<int, 2> spheres{-1, -1};
  double gap = std::numeric_limits<double>::infinity();
};
NearestPair nearest_pair(const Kinematics& arm);

}  // namespace steadyhand
