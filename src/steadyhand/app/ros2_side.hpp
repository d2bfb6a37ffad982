#pragma once

#include <atomic>
#include <memory>

#include "steadyhand/app/arm_choice.hpp"
#include "steadyhand/console/operator_interface.hpp"

namespace steadyhand {

class Ros2Bridge;

/// A session's side towards a ROS 2 domain, beside the arm: RViz, and poses from a topic as the operator's hand. They
/// count only while nobody leads the arm at the page.
class Ros2Side {
 public:
  Ros2Side();
  ~Ros2Side();

  /// Joins the domain if the arm or the settings ask for it, else does nothing. Everything must outlive it.
  Status open(const ArmChoice& choice, const RobotModel& model, const SessionSettings& settings, const Clock& clock,
              LiveSession& session, OperatorInterface& operator_interface);
  /// Leaves: no callback comes after it.
  void close();
  /// Somebody at the page leads the arm, or nobody. Any thread.
  void lead_at_page(bool somebody) { at_page_ = somebody; }
  /// Call every few milliseconds.
  void poll(Time now, const LiveSession& session);

 private:
  std::unique_ptr<Ros2Bridge> bridge_;
  std::atomic<bool> at_page_{false};
  Time shown_{0};
};

}  // namespace steadyhand
