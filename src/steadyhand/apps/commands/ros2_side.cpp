#include "steadyhand/apps/commands/ros2_side.hpp"

#ifdef STEADYHAND_ROS2
#include "steadyhand/arms/ros2/ros2_bridge.hpp"
#else
namespace steadyhand {
class Ros2Bridge {};
class SceneKeeper {};
}  // namespace steadyhand
#endif

namespace steadyhand {

Ros2Side::Ros2Side() = default;
Ros2Side::~Ros2Side() = default;

void Ros2Side::close() { bridge_.reset(); }  // before what its callbacks use

#ifdef STEADYHAND_ROS2

namespace {

constexpr Time kShowPeriod = std::chrono::milliseconds(40);
constexpr Time kSayPeriod = std::chrono::seconds(1);

}  // namespace

Status Ros2Side::open(const ArmChoice& choice, const RobotModel& model, const SessionSettings& settings,
                      const Clock& clock, LiveSession& session, OperatorInterface& operator_interface,
                      std::function<void(std::string)> say) {
  if (choice.kind() != &kRos2Controller && !settings.ros2.show && !settings.ros2.scene) return Done{};
  auto bridge = Ros2Bridge::open(
      model, settings.live.glass, settings.ros2, clock,
      [this, &operator_interface](const OperatorSample& sample) {
        if (!at_page_) operator_interface.hand(sample);
      },
      [&session](const char* what) { session.fail("listening to ROS 2 failed: restart the program", what); });
  if (!bridge) return bridge.error();
  bridge_ = std::move(*bridge);
  say_ = std::move(say);
  if (!settings.ros2.scene) return Done{};
  scene_ = std::make_unique<SceneKeeper>(model, settings.ros2.prefix);
  return take_scene(session, clock);
}

/// Each message changes the cell before the next one is read. A refused change is reported, once a second at most.
Status Ros2Side::take_scene(LiveSession& session, const Clock& clock) {
  return bridge_->listen_to_scene([this, &session, &clock](const Result<SceneChange>& change) {
    const Time now = clock.now();
    const Result<Kinematics> arm = session.arm_at(now);
    const Status done =
        !change ? Status(change.error())
        : !arm  ? Status(arm.error())
                : session.change_cell([&](Cell cell) { return scene_->apply(*change, std::move(cell), *arm); }, now);
    const std::lock_guard lock(saying_);
    if (done || (said_at_ && now - *said_at_ < kSayPeriod)) return;
    said_at_ = now;
    say_("note: a scene from ROS 2 is ignored: " + done.error().message + "\n");
  });
}

void Ros2Side::poll(Time now, const LiveSession& session) {
  if (!bridge_) return;
  bridge_->poll(now);
  if (now - shown_ < kShowPeriod) return;
  shown_ = now;
  bridge_->publish(session.snapshot(), !at_page_);
  for (const std::string& notice : bridge_->take_notices()) say_("note: " + notice + "\n");
}

#else

Status Ros2Side::open(const ArmChoice&, const RobotModel&, const SessionSettings& settings, const Clock&, LiveSession&,
                      OperatorInterface&, std::function<void(std::string)>) {
  return settings.ros2.show || settings.ros2.scene ? has_ros2() : Status(Done{});
}

void Ros2Side::poll(Time, const LiveSession&) {}

#endif

}  // namespace steadyhand
