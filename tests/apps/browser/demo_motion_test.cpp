#include <gtest/gtest.h>

#include <algorithm>

#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/operator/protocol/session_setup.hpp"
#include "steadyhand/session/live/one_thread_session.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

/// A recorded hand that rests for 1 s and goes 10 cm to its right in another.
Recording aside() {
  Recording recording;
  for (int i = 0; i <= 180; ++i) {
    OperatorSample sample;
    sample.stamp.hand = sample.stamp.made = i * Time(std::chrono::milliseconds(11));
    sample.X_operator_hand.p = Vector3(0.1, 0.3, 1.2) + 0.1 * std::max(0, i - 90) / 90.0 * Vector3::UnitX();
    sample.X_operator_hand.q = Eigen::AngleAxisd(0.4, Vector3::UnitZ());
    sample.clutch = true;
    recording.samples.push_back(sample);
  }
  return recording;
}

/// In which axes the hand's translation and its rotation count.
class DemoMotion : public testing::TestWithParam<std::pair<MotionFrame, MotionFrame>> {};

/// If an operator has moved the arm elsewhere, the motion first returns it to where the session began.
TEST_P(DemoMotion, BeginsWhereTheSessionBegan) {
  SteppedClock clock({});
  SimulatedArm arm(ur5e(), ur5e().home, {}, clock);
  LiveSettings settings = operator_defaults();
  settings.planner_rate_hz = 50.0;
  settings.time_budget = false;
  settings.planning.retarget.translation_frame = GetParam().first;
  settings.planning.retarget.rotation_frame = GetParam().second;
  const std::vector<Profile> profiles{*load_profile("tracking")};
  take_profiles(profiles, 0, settings);
  const auto session = std::move(*OneThreadSession::make(ur5e(), settings, arm, clock));
  OperatorInterface desk(*session, profiles, 0, settings.planning.retarget, settings.glass, {{"aside", aside()}});
  SessionSnapshot look;
  OperatorSample person;
  bool person_leads = false;
  LiveTaps taps;
  taps.look = [&](const SessionSnapshot& now) {
    look = now;
    person.stamp = {now.now, now.now};
    if (person_leads) desk.hand(person);
  };
  session->start(std::move(taps));
  const auto run = [&](double seconds) {
    for (const Time end = clock.now() + from_seconds(seconds); clock.now() < end;) {
      session->step();
      (void)desk.poll(clock.now());
    }
  };
  run(0.3);
  const Pose home = look.tools[0].X_base_tool;
  const auto off = [&] { return (look.tools[0].X_base_tool.p - home.p).norm(); };

  person_leads = true;
  run(0.2);
  person.clutch = true;
  for (int i = 0; i < 200; ++i) {
    person.X_operator_hand.p += Vector3(0.003, 0.002, -0.001);
    person.X_operator_hand.q = Eigen::AngleAxisd(0.004 * i, Vector3::UnitZ());
    run(0.01);
  }
  person.clutch = false;
  run(1.5);
  person_leads = false;
  ASSERT_GT(off(), 0.25);

  ASSERT_TRUE(desk.apply({OperatorRequest::Kind::kPlayback, "aside", 0.0}, clock.now()));
  double nearest = off(), turned = look.tools[0].X_base_tool.q.angularDistance(home.q);
  for (int i = 0; i < 500; ++i) {
    run(0.01);
    if (off() > nearest) continue;
    nearest = off();
    turned = look.tools[0].X_base_tool.q.angularDistance(home.q);
  }
  EXPECT_LT(nearest, 0.01);
  EXPECT_LT(turned, 0.05);
  EXPECT_EQ(desk.controls().playback, 0);
  run(2.5);
  EXPECT_LT(off(), 0.07) << "5 cm from home, and back: half of what the hand moves";
}

constexpr MotionFrame kBase = MotionFrame::kBase, kTool = MotionFrame::kTool;
INSTANTIATE_TEST_SUITE_P(, DemoMotion,
                         testing::Values(std::pair(kBase, kBase), std::pair(kTool, kTool), std::pair(kTool, kBase),
                                         std::pair(kBase, kTool)));

}  // namespace
}  // namespace steadyhand
