#include <cmath>
#include <optional>
#include <utility>

#include "geometry/robot/random_arm.hpp"
#include "support/allocation_guard.hpp"
#include "support/manual_clock.hpp"
#include "support/ur/lockstep.hpp"

namespace steadyhand {
namespace {

/// Through the program's start, following, a cable that is out for a moment and then for long, and a second start.
TEST(UrHotPath, ReceivingAndSendingDoNotAllocate) {
  std::mt19937 random(3);
  RobotModel model = random_arm(6, random, false);
  model.home = random_joints(6, 1.0, random);
  ManualClock clock;
  UrLockstep arm(model, {}, clock);
  std::optional<AllocationGuard> guard;
  std::size_t allocations = 0, calls = 0;
  arm.around_arm = [&](bool begins) {
    if (begins) {
      guard.emplace();
      return;
    }
    allocations += guard->count();
    guard.reset();
    ++calls;
  };
  ArmState state;
  bool began = false;
  Time begin{0};
  JointVector q0;
  const auto run = [&](int cycles) {
    for (int i = 0; i < cycles; ++i) {
      state = arm.receive();
      if (state.status != ArmStatus::kFollowing) {
        began = false;
        continue;
      }
      const Time now = state.joints.stamp.made;
      if (!std::exchange(began, true)) {
        begin = now;
        q0 = state.joints.q;
      }
      const double t = to_seconds(now - begin);
      const JointVector ones = JointVector::Ones(6);
      arm.send({{now, now},
                q0 + 0.1 * (1.0 - std::cos(2.0 * t)) * ones,
                0.2 * std::sin(2.0 * t) * ones,
                0.4 * std::cos(2.0 * t) * ones});
    }
  };
  run(1000);
  ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  arm.controller.unplug(5);
  run(200);
  EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  arm.controller.unplug(200);
  run(300);
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  arm.restart();
  run(1000);
  EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  EXPECT_GT(calls, 3000u);
  EXPECT_EQ(allocations, 0u);
}

}  // namespace
}  // namespace steadyhand
