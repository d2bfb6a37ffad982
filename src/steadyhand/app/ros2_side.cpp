#include "steadyhand/app/ros2_side.hpp"

#ifdef STEADYHAND_ROS2
#include "steadyhand/ros2/ros2_bridge.hpp"
#else
namespace steadyhand {
class Ros2Bridge {};
}  // namespace steadyhand
#endif

namespace steadyhand {

Ros2Side::Ros2Side() = default;
Ros2Side::~Ros2Side() = default;

void Ros2Side::close() { bridge_.reset(); }

#ifdef STEADYHAND_ROS2

namespace {

constexpr Time kShowPeriod = std::chrono::milliseconds(40);

}  // namespace

Status Ros2Side::open(const ArmChoice& choice, const RobotModel& model, const SessionSettings& settings,
                      const Clock& clock, LiveSession& session, OperatorInterface& operator_interface) {
  if (choice.kind() != &kRos2Controller && !settings.ros2.show) return Done{};
  auto bridge = Ros2Bridge::open(
      model, settings.live.glass, settings.ros2, clock,
      [this, &operator_interface](const OperatorSample& sample) {
        if (!at_page_) operator_interface.hand(sample);
      },
      [&session](const char* what) { session.fail("listening to ROS 2 failed: restart the program", what); });
  if (!bridge) return bridge.error();
  bridge_ = std::move(*bridge);
  return Done{};
}

void Ros2Side::poll(Time now, const LiveSession& session) {
  if (!bridge_) return;
  bridge_->poll(now);
  if (now - shown_ < kShowPeriod) return;
  shown_ = now;
  bridge_->publish(session.snapshot());
}

#else

Status Ros2Side::open(const ArmChoice&, const RobotModel&, const SessionSettings& settings, const Clock&, LiveSession&,
                      OperatorInterface&) {
  return settings.ros2.show ? has_ros2() : Status(Done{});
}

void Ros2Side::poll(Time, const LiveSession&) {}

#endif

}  // namespace steadyhand
