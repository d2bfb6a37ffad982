// The independent monitor detects faults, counts them, and reports by how much limits are exceeded.
#include "steadyhand/session/live/monitor.hpp"

#include <random>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Witness : testing::Test {
  JointCommand command(double t, const JointVector& q, const JointVector& dq) const {
    return {{from_seconds(t), from_seconds(t)}, q, dq, none};
  }
  JointCommand standing(double t) const { return command(t, ur5e().home, none); }
  /// The result of a second command `seconds` after a stationary one.
  MonitorResult after(double seconds, const JointVector& q, const JointVector& dq, bool anew = false) {
    Monitor witness(ur5e(), {});
    witness.update(standing(1.0));
    EXPECT_EQ(witness.result().beyond_limits, 0u);
    witness.update(command(1.0 + seconds, q, dq), anew);
    return witness.result();
  }
  /// `value` in the second joint, 0 elsewhere.
  static JointVector one(double value) {
    JointVector all = JointVector::Zero(6);
    all[1] = value;
    return all;
  }

  const JointVector none = JointVector::Zero(6), home = ur5e().home;
  const double fastest = ur5e().velocity_max[1], most = ur5e().acceleration_max[1];
};

TEST_F(Witness, HasNothingAgainstMotionAtTheLimits) {
  Monitor witness(ur5e(), {});
  for (const double dt : {0.002, 0.02, 0.1}) {  // however far apart commands are
    for (int k = 0; k * dt < 0.4; ++k) {
      const double t = k * dt, up = std::min(t, 0.2), down = t - up;
      JointCommand c =
          command(10.0 / dt + t, home + one(0.5 * most * up * up + down * most * 0.2 - 0.5 * most * down * down),
                  one(most * (up - down)));
      c.ddq = one(t < 0.2 ? most : -most);
      witness.update(c, k == 0);
    }
  }
  EXPECT_EQ(witness.result().beyond_limits, 0u) << to_text(witness.result());
  EXPECT_GT(witness.result().commands, 200u);
  EXPECT_NE(to_text(witness.result()).find(" 0 beyond a limit, 0 in contact"), std::string::npos);
}

/// A gripper has no glass that could spill.
TEST_F(Witness, KnowsWhoHoldsAGlass) {
  for (const bool has_glass : {true, false}) {
    RobotModel arm = ur5e();
    if (!has_glass) arm.tools[0].gripper_time = 0.6;
    Monitor witness(arm, {});
    for (int k = 0; k < 500; ++k) {
      const double t = 0.002 * k, swing = 12.0;
      const Time at = from_seconds(t);
      witness.update(JointState{{at, at}, home, one(0.8 * std::sin(swing * t))});
    }
    EXPECT_EQ(witness.liquid().spilled, has_glass);
    EXPECT_EQ(witness.liquid().lateral > 0.0, has_glass);
  }
}

TEST_F(Witness, NamesWhatTheArmIsIn) {
  Kinematics arm(ur5e());
  arm.set_position(home);
  Cell cell;
  for (const char* name : {"far", "ball", "touchable"}) {
    CellObject& object = cell.objects.emplace_back();
    object.name = name;
    object.shape = Shape::sphere(0.05);
    object.origin = Eigen::Translation3d(arm.p());
  }
  cell.objects[0].origin.translation() += Vector3(0.0, 0.0, 2.0);
  for (const Body& body : ur5e().bodies) cell.objects[2].may_be_touched_by.push_back(body.name);
  Monitor witness(ur5e(), {});
  const auto obstacles = obstacles_of(cell, ur5e());
  ASSERT_TRUE(obstacles) << obstacles.error().message;
  witness.set_obstacles(*obstacles, {"far", "ball", "touchable"});
  witness.update(JointState{{Time(0), Time(0)}, home, none});
  const std::vector<std::string> lines = witness.overlaps();
  ASSERT_EQ(lines.size(), 1u) << lines.back();
  EXPECT_EQ(lines[0].find("the arm is inside the object 'ball': its body '"), 0u) << lines[0];
}

TEST_F(Witness, CountsPositionsBeyondTheirLimits) {
  JointVector q = home;
  q[2] = ur5e().position_max[2] + 1e-5;
  const MonitorResult seen = after(100.0, q, none);
  EXPECT_EQ(seen.beyond_limits, 1u);
  EXPECT_NEAR(seen.position_excess, 1e-5, 1e-9);
  q[2] = kNan;
  EXPECT_EQ(after(100.0, q, none).beyond_limits, 1u);
}

TEST_F(Witness, CountsSpeedsAndAccelerationsThatCommandsTellOf) {
  Monitor witness(ur5e(), {});
  witness.update(command(1.0, home, one(fastest + 0.01)));
  EXPECT_EQ(witness.result().beyond_limits, 1u);
  EXPECT_NEAR(witness.result().speed_excess, 0.01, 1e-9);
  JointCommand c = standing(1.002);
  c.ddq = one(-most - 0.1);
  witness.update(c, true);
  EXPECT_EQ(witness.result().beyond_limits, 2u);
  EXPECT_NEAR(witness.result().acceleration_excess, 0.1, 1e-9);
}

/// A jump by 65 mrad after 50 ms, as a loop makes that goes by time; and in no time, or after long.
TEST_F(Witness, CountsWhatBecameOfCommandsHoweverFarTheyAreApart) {
  const MonitorResult stalled = after(0.05, home + one(0.065), none);
  EXPECT_EQ(stalled.beyond_limits, 1u);
  EXPECT_NEAR(stalled.step, 0.065 - 0.25 * most * 0.05 * 0.05, 1e-6);
  EXPECT_EQ(after(0.002, home + one(0.001), none).beyond_limits, 1u);  // 0.5 rad/s
  EXPECT_GT(after(0.002, home + one(0.01), none).speed_excess, 1.0);
  const MonitorResult jolt = after(0.05, home + one(0.025), one(1.0));
  EXPECT_EQ(jolt.beyond_limits, 1u);
  EXPECT_NEAR(jolt.acceleration_excess, 20.0 - most, 1e-6);
  EXPECT_EQ(after(1.0, home + one(3.5), none).beyond_limits, 1u);
  EXPECT_EQ(after(1.0, home + one(1.0), none).beyond_limits, 0u);
  EXPECT_EQ(after(0.0, home, none).beyond_limits, 1u);
  EXPECT_EQ(after(0.002, home + one(0.3), none, true).beyond_limits, 0u);  // restarted there
}

TEST_F(Witness, CountsMeasuredSpeeds) {
  Monitor witness(ur5e(), {});
  witness.update(JointState{{Time(0), from_seconds(1.0)}, home, one(fastest)});
  EXPECT_EQ(witness.result().too_fast, 0u);
  witness.update(JointState{{Time(0), from_seconds(1.002)}, home, one(-5.48)});
  EXPECT_EQ(witness.result().too_fast, 1u);
  EXPECT_NEAR(witness.result().measured_excess, 5.48 - fastest, 1e-9);
  EXPECT_NE(to_text(witness.result()).find("1 beyond a speed limit, by 2.34 rad/s"), std::string::npos)
      << to_text(witness.result());
}

/// Poses of spheres that overlap by less than a plan may between nodes.
TEST_F(Witness, CountsOverlapOfATenthOfAMillimetre) {
  Kinematics arm(ur5e());
  std::mt19937 random(1);
  const auto clearance = [&](const JointVector& q) { return arm.set_position(q), steadyhand::clearance(arm); };
  JointVector into;
  do {
    into =
        home + 2.0 * JointVector::NullaryExpr(6, [&] { return std::uniform_real_distribution<double>(-1, 1)(random); });
  } while (clearance(into) > -0.02);
  double clear = 0.0, touching = 1.0;  // shares of the way there
  for (int i = 0; i < 60; ++i) {
    const double half = 0.5 * (clear + touching);
    (clearance(home + half * (into - home)) > -1e-4 ? clear : touching) = half;
  }
  const MonitorResult seen = after(100.0, home + clear * (into - home), none);
  EXPECT_EQ(seen.in_contact, 1u);
  EXPECT_NEAR(seen.smallest_clearance, -1e-4, 1e-8);
  EXPECT_NE(to_text(seen).find("1 in contact; smallest gap -0.1 mm"), std::string::npos) << to_text(seen);
}

/// The program was suspended while the glass swung a little.
TEST_F(Witness, SeesNoSpillInASuspensionOfAnyLength) {
  for (const double pause : {0.1, 1.0, 23.0, 60.0, 3600.0}) {
    Monitor witness(ur5e(), {});
    const auto seen = [&](double t, double speed) {
      witness.update(JointState{{from_seconds(t), from_seconds(t)}, home, one(speed)});
    };
    for (int k = 0; k < 100; ++k) seen(1.0 + 0.002 * k, 0.02 * std::sin(0.05 * k));
    EXPECT_GT(witness.liquid().freeboard, 0.004);
    seen(1.2 + pause, 0.02);
    EXPECT_FALSE(witness.liquid().spilled) << pause;
    EXPECT_GT(witness.liquid().least_freeboard, 0.004) << pause;
  }
}

}  // namespace
}  // namespace steadyhand
