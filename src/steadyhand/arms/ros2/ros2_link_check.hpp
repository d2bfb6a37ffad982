#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "steadyhand/arms/driver/offset_filter.hpp"
#include "steadyhand/arms/driver/ros2_settings.hpp"
#include "steadyhand/arms/ros2/joint_states.hpp"
#include "steadyhand/arms/ros2/node.hpp"
#include "steadyhand/core/histogram.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Messages that a ROS 2 machine sent in a period. Times in us.
struct Ros2LinkReport {
  std::uint64_t states = 0;                                 ///< states that name all joints
  std::uint64_t strangers = 0;                              ///< states on the same topic that do not
  std::array<std::uint64_t, kJointStateFaults> unusable{};  ///< unusable states that name them, by JointStateFault
  double pace = 1.0;                                        ///< s of their stamps for each s of ours
  JointVector q;                                            ///< positions of the newest state; of size 0: none
  std::size_t publishers = 0;                               ///< that send states with all joints
  double seconds = 0.0;
  double longest_gap = 0.0;      ///< between two states
  TimingSummary late;            ///< delay of states' arrival, compared with the earliest
  TimingSummary wake;            ///< how late this machine wakes from a sleep
  int controllers = 0;           ///< that listen for trajectories
  std::uint64_t commanders = 0;  ///< trajectories that other programs sent
  bool stamped = true;           ///< states have stamps
  bool active = false;           ///< a controller sends its state, as it does while it is active
  double speed_scaling = 100.0;  ///< %, smallest that the hardware reported
  std::optional<int> grippers;   ///< action servers of the gripper; none: the robot has no gripper
};

struct Ros2LinkJudgement {
  bool fit = false;
  std::vector<std::string> findings;  ///< what is wrong, and what to change, most important first
};

/// Fit: no gap between states is long enough to stop the arm, and there is exactly one controller, which is active, at
/// full speed, and not commanded by another program.
Ros2LinkJudgement judge(const Ros2LinkReport& report, const Ros2Settings& settings, const RobotModel& model);

/// Collects the report. One thread.
class Ros2LinkMeter {
 public:
  /// @param stamp 0: it has none
  void state(Time arrival, Time stamp, Ros2PublisherId publisher);
  void unusable(JointStateFault fault) { ++report_.unusable[static_cast<std::size_t>(fault)]; }
  void measured(const JointVector& q) { report_.q = q; }
  void stranger() { ++report_.strangers; }
  void commanded() { ++report_.commanders; }
  void active() { report_.active = true; }
  /// NaN does not count as full speed.
  void slowed_down(double percent) {
    if (!(percent >= report_.speed_scaling)) report_.speed_scaling = percent >= 0.0 ? percent : 0.0;
  }
  void woke(Time late) { wake_.add(1e-3 * static_cast<double>(late.count())); }
  Ros2LinkReport report(int controllers) const;

 private:
  Ros2LinkReport report_;
  Histogram late_, wake_;
  Time first_{0}, last_{0}, first_stamp_{0}, last_stamp_{0};
  OffsetFilter earliest_;
  std::set<Ros2PublisherId> publishers_;
};

/// Listens for this time, with real-time priority if that is granted; sends nothing. @param ends asked every 10 ms
Result<Ros2LinkReport> measure_ros2_link(const RobotModel& model, const Ros2Settings& settings, double seconds,
                                         const std::function<bool()>& ends);

}  // namespace steadyhand
