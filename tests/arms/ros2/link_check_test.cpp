// Whether the link to a ROS 2 machine is fit to control an arm, from synthetic arrival times.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ros2/ros2_link_check.hpp"

namespace steadyhand {
namespace {

/// 10 s of states at 500 Hz that take `delay(i)` s.
Ros2LinkReport measure(const std::function<double(int)>& delay, int publishers = 1) {
  Ros2LinkMeter meter;
  Time last{0};
  for (int i = 1; i <= 5000; ++i) {
    const Time arrival = std::max(last + Time(1000), from_seconds(50.0 + 0.002 * i + delay(i)));
    last = arrival;
    meter.state(arrival, from_seconds(1000.0 + 0.002 * i), static_cast<Ros2PublisherId>(7 + i % publishers));
    meter.woke(std::chrono::microseconds(20));
  }
  meter.active();
  return meter.report(1);
}

/// For an arm with one joint.
Ros2LinkJudgement judge(const Ros2LinkReport& report, const Ros2Settings& settings) {
  static const RobotModel model = [] {
    std::mt19937 random(1);
    return random_arm(1, random, false);
  }();
  return judge(report, settings, model);
}

bool says(const Ros2LinkReport& report, const char* word) {
  for (const std::string& line : judge(report, {}).findings) {
    if (line.find(word) != std::string::npos) return true;
  }
  return false;
}

TEST(Ros2Link, AQuietOneIsFit) {
  const Ros2LinkReport r = measure([](int) { return 3e-4; });
  EXPECT_EQ(r.states, 5000u);
  EXPECT_NEAR(r.seconds, 10.0, 0.01);
  EXPECT_NEAR(r.longest_gap, 2000.0, 1.0);
  EXPECT_TRUE(judge(r, {}).fit);
  EXPECT_TRUE(judge(r, {}).findings.empty());
}

TEST(Ros2Link, SilenceThatStopsTheArmIsUnfit) {
  const auto held_up = [](double seconds) { return measure([=](int i) { return i % 2000 == 500 ? seconds : 3e-4; }); };
  EXPECT_TRUE(judge(held_up(0.025), {}).fit);
  EXPECT_TRUE(says(held_up(0.025), "had gaps"));
  EXPECT_FALSE(judge(held_up(0.08), {}).fit);
}

TEST(Ros2Link, SaysWhatToChange) {
  EXPECT_TRUE(says(Ros2LinkReport{}, "is the driver running"));
  EXPECT_TRUE(says(measure([](int) { return 3e-4; }, 2), "2 publishers"));
  Ros2LinkReport r = measure([](int) { return 3e-4; });
  r.controllers = 0;
  EXPECT_TRUE(says(r, "no controller listens"));
  EXPECT_FALSE(judge(r, {}).fit);
  r = measure([](int) { return 3e-4; });
  r.active = false;
  EXPECT_TRUE(says(r, "/joint_trajectory_controller listens, but is not active"));
  EXPECT_TRUE(says(r, "--activate joint_trajectory_controller"));
  EXPECT_FALSE(judge(r, {}).fit);
  r = measure([](int) { return 3e-4; });
  r.speed_scaling = 50.0;
  EXPECT_TRUE(says(r, "50 %"));
  EXPECT_FALSE(judge(r, {}).fit);
  r = measure([](int) { return 3e-4; });
  r.commanders = 3;
  EXPECT_TRUE(says(r, "another program sent 3"));
  r = measure([](int) { return 3e-4; });
  r.grippers = 1;
  EXPECT_TRUE(judge(r, {}).fit);
  r.grippers = 0;
  EXPECT_TRUE(says(r, "0 action servers answer for the gripper at /gripper_controller/gripper_cmd"));
  EXPECT_FALSE(judge(r, {}).fit);
  r = measure([](int) { return 3e-4; });
  r.stamped = false;
  EXPECT_TRUE(says(r, "carry no stamp"));
  r = measure([](int) { return 3e-4; });
  r.unusable[static_cast<std::size_t>(JointStateFault::kNotFinite)] = 3;
  EXPECT_TRUE(says(r, "3 of 5003 states cannot be used"));
  EXPECT_FALSE(judge(r, {}).fit);
  r.states = 0;
  EXPECT_TRUE(says(r, "not a finite number"));
  EXPECT_FALSE(says(r, "is the driver running"));
  r = measure([](int) { return 3e-4; });
  r.q = JointVector::Constant(1, 100.0);
  EXPECT_TRUE(says(r, "is at 100, beyond its position limits"));
  EXPECT_FALSE(judge(r, {}).fit);
  r = measure([](int) { return 3e-4; });
  r.wake.max = 20000.0;
  EXPECT_TRUE(says(r, "wakes up to 20.0 ms"));
  r = measure([](int) { return 3e-4; });
  r.seconds = 100.0;
  EXPECT_TRUE(says(r, "have 50 Hz"));
}

TEST(Ros2Link, StampsThatAreNoTimeOfMeasurementAreUnfit) {
  for (const double pace : {0.0, 0.5, 0.97, 1.0, 1.001, 2.0}) {
    Ros2LinkMeter meter;
    for (int i = 1; i <= 5000; ++i)
      meter.state(from_seconds(50.0 + 0.002 * i), from_seconds(1000.0 + 0.002 * pace * i), 7);
    meter.active();
    const Ros2LinkReport r = meter.report(1);
    EXPECT_EQ(judge(r, {}).fit, std::abs(pace - 1.0) < 0.01) << pace;
    EXPECT_EQ(says(r, "does not change"), pace == 0.0) << pace;
    EXPECT_EQ(says(r, "of real time"), pace > 0.0 && std::abs(pace - 1.0) > 0.01) << pace;
  }
}

TEST(Ros2Link, AScalingThatIsNoNumberIsNoFullSpeed) {
  for (const double percent : {std::nan(""), -std::numeric_limits<double>::infinity()}) {
    Ros2LinkMeter meter;
    meter.slowed_down(100.0);
    meter.slowed_down(percent);
    meter.slowed_down(100.0);
    EXPECT_EQ(meter.report(1).speed_scaling, 0.0);
  }
}

}  // namespace
}  // namespace steadyhand
