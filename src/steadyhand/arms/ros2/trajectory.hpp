#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <span>
#include <string>
#include <vector>

#include "steadyhand/arms/ros2/node.hpp"
#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/latest_value.hpp"

namespace steadyhand {

/// Commands and the rest of their plan, as points for a controller that joins them by quintics. First come the
/// commands, which the controller executes already, so that it can take over anywhere among them without a step. Then
/// comes the plan until it is at rest. A plan's acceleration jumps at its nodes, and a quintic from node to node would
/// overshoot by a third of the jump. Therefore a point lies just before and just after each node; between nodes the
/// quintics are the plan itself.
/// @param commands in order of time, at least one, the last one on the plan
/// @param points their stamps say when; strictly increasing; the last one at rest, its velocity exactly 0
void make_trajectory(std::span<const JointCommand> commands, const Plan& plan, std::vector<JointCommand>& points);

/// The commands of the last cycles; holds any lead and delay. Allocates nothing.
class SentCommands {
 public:
  void clear() { count_ = 0; }
  void add(const JointCommand& command) {
    newest_ = (newest_ + 1) % kMost;
    commands_[newest_] = command;
    count_ = std::min(count_ + 1, kMost);
  }
  bool empty() const { return count_ == 0; }
  int count() const { return count_; }
  /// @param age 0: the newest; < count()
  const JointCommand& operator[](int age) const { return commands_[(newest_ - age + kMost) % kMost]; }
  /// The one that was the newest at time t, carried on at its speed; of size 0 if that is before all.
  JointCommand at(Time t) const {
    for (int age = 0; age < count_; ++age) {
      const JointCommand& command = (*this)[age];
      if (command.stamp.made > t) continue;
      JointCommand expected = command;
      expected.q += to_seconds(t - command.stamp.made) * command.dq;
      return expected;
    }
    return {};
  }

 private:
  static constexpr int kMost = 512;
  std::array<JointCommand, kMost> commands_;
  int newest_ = 0, count_ = 0;
};

/// The next message for a joint trajectory controller.
struct TrajectoryOrder {
  static constexpr int kCommands = 128;
  std::array<JointCommand, kCommands> commands;  ///< in order of time
  int count = 0;
  Plan plan;
  Time begin{0};     ///< the trajectory's, on our clock
  Time executes{0};  ///< when the controller does, on its clock

  TrajectoryOrder() = default;
  TrajectoryOrder(const TrajectoryOrder& other) { *this = other; }
  TrajectoryOrder& operator=(const TrajectoryOrder& other);  ///< copies the entries in use
};

/// Brings orders from the control thread to the controller: the newest only. A second thread writes the messages.
class TrajectorySender {
 public:
  explicit TrajectorySender(const std::vector<std::string>& names);
  Status open(Ros2Node& node, const std::string& topic, Time lifespan);
  int subscribers() const { return trajectories_.subscribers(); }

  void post(const TrajectoryOrder& order) {
    orders_.write(order);
    wake();
  }
  void wake() {
    ++posted_;
    posted_.notify_one();
  }
  /// Waits for a post after `seen`, or until it is woken. @return `seen` for the next call
  int wait(int seen) const {
    posted_.wait(seen);
    return posted_;
  }
  void send_newest();

 private:
  Ros2Publisher<JointTrajectoryMessage> trajectories_;
  LatestValue<TrajectoryOrder> orders_;
  std::atomic<int> posted_{0};
  TrajectoryOrder order_;
  // The message in the form in which DDS wants it, with the memory behind it.
  std::vector<std::string> joints_;
  std::vector<char*> names_;
  std::vector<JointCommand> points_;
  std::vector<JointTrajectoryPointMessage> messages_;
  std::string frame_;
};

}  // namespace steadyhand
