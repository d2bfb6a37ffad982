#pragma once

#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/time.hpp"

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

/// Does with trajectories on its topic what the joint_trajectory_controller of ros2_controllers 4.42 (Jazzy, Kilted)
/// does, by its source: it replaces the present one in the next cycle, sets its trajectory time to now with each new
/// one and from then on advances it by the period times the speed scaling. It writes the sample a period ahead. Beyond
/// a tolerance it writes nothing and holds the joints where they are measured. Inactive, it accepts nothing. Not
/// simulated: actions, effort, integration, continuous joints. One thread.
class JointTrajectoryController {
 public:
  /// Parameters of that name.
  struct Settings {
    std::vector<std::string> joints;
    bool allow_nonzero_velocity_at_trajectory_end = false;
    bool allow_partial_joints_goal = false;
    bool interpolate_from_desired_state = false;
    bool allow_trajectory_replacement = false;
    Time period = std::chrono::milliseconds(2);  ///< 1 / update_rate
    double goal_time = 0.0;                      ///< s; 0: no end to the waiting
    double trajectory = 0.0;                     ///< rad, each joint, on the way; 0: any
    double goal = 0.0;                           ///< rad, each joint, at the end; 0: any
  };
  struct State {
    JointVector q, dq, ddq;
  };

  /// Inactive until activate().
  explicit JointTrajectoryController(Settings settings) : settings_(std::move(settings)) {}

  void activate(const JointVector& q);
  /// Forgets all.
  void deactivate();
  bool active() const { return active_; }
  /// Takes a trajectory, or refuses it and continues with the present one. @return why it is refused; empty: accepted
  std::string accept(const JointTrajectory& trajectory, Time now);
  /// One cycle. @param period since the last one @return what the joints are to do, a cycle from now
  const State& update(Time now, Time period, const JointVector& q, const JointVector& dq);
  /// The trajectory's sample for now, as published.
  const State& reference() const { return reference_; }
  /// Share of the speed at which trajectories are executed.
  void scale(double speed) { scaling_ = speed; }
  /// Why the last trajectory was given up, if it was.
  const std::string& aborted() const { return aborted_; }
  const Settings& settings() const { return settings_; }

 private:
  struct Motion {
    Time stamp{0};
    std::vector<JointTrajectory::Point> points;  ///< in the order of our joints
  };
  std::string refusal(const JointTrajectory& trajectory, Time now) const;
  void begin(Motion motion, const JointVector& q);
  bool sample(Time then, State& state) const;
  void hold(const JointVector& q);
  bool keeps_tolerances(const JointVector& q, Time next, bool first);

  Settings settings_;
  bool active_ = false, holds_ = false, sampled_ = false;
  double scaling_ = 1.0;
  std::optional<Motion> waiting_;  ///< accepted, not started
  Motion motion_;
  Time time_{0};                   ///< the trajectory's time
  JointTrajectory::Point before_;  ///< where it stood when the motion began
  Time before_at_{0};
  State reference_, commanded_;
  std::optional<Time> commanded_at_;
  std::string aborted_;
};

}  // namespace steadyhand
