#pragma once

#include <array>
#include <atomic>
#include <string>
#include <vector>

#include "steadyhand/arms/driver/offset_filter.hpp"
#include "steadyhand/arms/driver/ros2_settings.hpp"
#include "steadyhand/arms/ros2/joint_states.hpp"
#include "steadyhand/arms/ros2/node.hpp"
#include "steadyhand/core/latest_value.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// What an arm's topics of ROS 2 report, and why it may not move by them. DDS's thread calls receive(), the control
/// thread everything else, fail() any thread. Allocates nothing once made.
class Ros2Feedback {
 public:
  /// The newest joint states.
  struct Received {
    JointVector q, dq;
    Time theirs{0}, arrival{0};  ///< stamp on the controller's clock; when it came, on ours
    Time offset{0};              ///< ours less theirs
    Time gap{0};                 ///< since the state before, on our clock
    bool off_pace = false;       ///< their clock is slower or faster than ours
    int controllers = 0;         ///< that listen to our trajectories
  };
  /// The newest report of the controller, which it sends only while it is active.
  struct Told {
    JointVector q;  ///< its set-point; of size 0 where it names other joints
    Time theirs{0}, arrival = -std::chrono::hours(1);
  };
  enum class Trouble : int { kNone, kTwoStatePublishers, kTwoCommanders, kClockJumped, kThrew };

  /// The clock must outlive it. @param names of the joints @param topic of the trajectories
  Ros2Feedback(const Ros2Settings& settings, const Clock& clock, const std::vector<std::string>& names,
               const std::string& topic);

  /// Ignores states of other joints. If a state of ours cannot be used, keeps the fault. @param controllers number of
  /// those that listen to our trajectories
  void receive(const JointStateMessage& message, Ros2PublisherId publisher, int controllers);
  void receive(const ControllerStateMessage& message);
  void receive(const Float64Message& speed_scaling);
  void fail(Trouble trouble) { trouble_ = trouble; }

  /// Takes in the news. @return whether there were joint states
  bool update();
  void set_following(bool follows) { following_.store(follows, std::memory_order_relaxed); }
  void forget_trouble() { trouble_ = Trouble::kNone; }
  bool known() const { return known_; }  ///< joint states have come
  const Received& state() const { return received_; }
  const Received& state_before() const { return received_before_; }
  const Told& told() const { return told_; }
  bool states_are_recent() const;
  /// Why there are none that could be used now.
  std::string_view why_no_states() const;
  /// Why the arm may not start or continue; empty: it may.
  std::string_view why_not() const;

 private:
  void clock_jumped(bool follows);
  void take_speeds(const JointVector& sent, bool same_publisher, Received& news) const;

  const Clock* clock_;
  Time state_timeout_;
  std::string no_controller_, not_active_, seldom_;          ///< reasons that name a topic
  std::array<std::string, kJointStateFaults> state_faults_;  ///< the same, by JointStateFault

  // ---- of the control thread
  Received received_, received_before_;
  Told told_;
  bool known_ = false;

  // ---- of the thread that listens
  JointOrder joints_, told_joints_;
  Received newest_;
  Told newest_told_;
  Ros2PublisherId state_publisher_ = 0;
  ClockPace pace_;
  OffsetFilter offset_;
  LatestValue<Received> received_news_;  ///< to the control thread
  LatestValue<Told> told_news_;
  std::atomic<JointStateFault> state_fault_{JointStateFault::kOtherJoints};  ///< newest unusable state: its fault ...
  std::atomic<Time> state_fault_at_{Time::min()};                            ///< ... and its arrival
  std::atomic<bool> slowed_down_{false};                                     ///< the hardware reports reduced speed
  std::atomic<Trouble> trouble_{Trouble::kNone};
  std::atomic<bool> following_{false};
};

}  // namespace steadyhand
