#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "steadyhand/apps/commands/arm_choice.hpp"
#include "steadyhand/operator/protocol/operator_interface.hpp"

namespace steadyhand {

class Ros2Bridge;
class SceneKeeper;

/// A session's connection to a ROS 2 domain, apart from the arm: RViz, poses from a topic as the operator's hand, and
/// MoveIt's objects. The poses count only while no client at the page has control.
class Ros2Side {
 public:
  Ros2Side();
  ~Ros2Side();

  /// Joins the domain if the arm or the settings ask for it, else does nothing. Everything must outlive it.
  Status open(const ArmChoice& choice, const RobotModel& model, const SessionSettings& settings, const Clock& clock,
              LiveSession& session, OperatorInterface& operator_interface, std::function<void(std::string)> say);
  /// Leaves: no callback comes after it.
  void close();
  /// Whether a client at the page has control. Any thread.
  void lead_at_page(bool somebody) { at_page_ = somebody; }
  /// Call every few milliseconds.
  void poll(Time now, const LiveSession& session);

 private:
  Status take_scene(LiveSession& session, const Clock& clock);

  std::unique_ptr<SceneKeeper> scene_;
  std::function<void(std::string)> say_;
  std::mutex saying_;
  std::optional<Time> said_at_;  ///< that a scene was not taken
  std::unique_ptr<Ros2Bridge> bridge_;
  std::atomic<bool> at_page_{false};
  Time shown_{0};
};

}  // namespace steadyhand
