#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/math.hpp"
#include "core/time.hpp"

namespace steadyhand {

/// A trajectory as it is sent to a controller; joints in any order.
struct JointTrajectory {
  struct Point {
    Time from_start{0};
    std::vector<double> q, dq, ddq;  ///< rad, rad/s, rad/s^2; dq, and ddq, may be empty
  };
  Time stamp{0};  ///< 0: now
  std::vector<std::string> joints;
  std::vector<Point> points;
};

/// The joint_trajectory_controller of ros2_control, as its documentation describes what a trajectory on its topic does:
/// userdoc.rst, trajectory.rst and the parameters' descriptions. Not there: actions, effort, integration, speed
/// scaling, continuous joints. One thread.
class JointTrajectoryController {
 public:
  /// Parameters of that name.
  struct Settings {
    std::vector<std::string> joints;
    bool allow_nonzero_velocity_at_trajectory_end = false;
    bool allow_partial_joints_goal = false;
    bool interpolate_from_desired_state = false;
    bool allow_trajectory_replacement = false;
    double goal_time = 0.0;   ///< s; 0: no end to the waiting
    double trajectory = 0.0;  ///< rad, each joint, on the way; 0: any
    double goal = 0.0;        ///< rad, each joint, at the end; 0: any
  };
  struct State {
    JointVector q, dq, ddq;
  };

  explicit JointTrajectoryController(Settings settings) : settings_(std::move(settings)) {}

  /// Takes a trajectory, or refuses it and goes on with what it has. @return why it is refused; empty: it is not
  std::string accept(const JointTrajectory& trajectory, Time now);
  /// One cycle. @return what the joints are to do
  const State& update(Time now, const JointVector& q, const JointVector& dq);
  /// Forgets all: at the next update it is active again, and holds the joints where they are.
  void deactivate();
  /// Why the last trajectory was given up, if it was.
  const std::string& aborted() const { return aborted_; }
  bool active() const { return active_; }
  const Settings& settings() const { return settings_; }

 private:
  struct Motion {
    Time stamp{0};
    std::vector<JointTrajectory::Point> points;  ///< in the order of our joints
  };
  std::string refusal(const JointTrajectory& trajectory, Time now) const;
  void begin(Motion motion, Time now, const JointVector& q, const JointVector& dq);
  void sample(Time now);
  void hold(const JointVector& q);
  void keep_tolerances(Time now, const JointVector& q);

  Settings settings_;
  std::optional<Motion> waiting_;  ///< accepted, not begun
  Motion motion_;
  bool active_ = false, held_ = false;
  JointTrajectory::Point before_;  ///< where it stood when the motion began
  Time before_at_{0};
  State desired_;
  std::string aborted_;
};

}  // namespace steadyhand
