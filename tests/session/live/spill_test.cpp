#include <gtest/gtest.h>

#include "support/virtual_session.hpp"
#include "support/watched_arm.hpp"

namespace steadyhand {
namespace {

/// A hand that reaches back and forth, turns and leans.
Pose brisk(double t) {
  Pose pose;
  pose.p = Vector3(0.25 * std::sin(2.3 * t), 0.3 * std::sin(1.7 * t + 1.0), 0.15 * std::sin(2.9 * t + 2.0));
  pose.q = Eigen::AngleAxisd(0.5 * std::sin(1.9 * t), Vector3::UnitX()) *
           Eigen::AngleAxisd(0.4 * std::sin(1.1 * t), Vector3::UnitZ());
  return pose;
}

VirtualSession::Options with(const std::string& profile) {
  VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
  options.profile = profile;
  return options;
}

TEST(Spill, CarryKeepsInTheGlassWhatTrackingSpills) {
  for (const bool carries : {true, false}) {
    VirtualSession session(with(carries ? "carry" : "tracking"));
    session.hand = brisk;
    ASSERT_TRUE(session.grip());
    session.run(10.0);
    EXPECT_EQ(session.spilled(), !carries);
    session.expect_safe();
  }
}

/// The hand releases at any moment, and moves on.
TEST(Spill, SoftStopsSpillNothing) {
  VirtualSession::Options options = with("carry");
  options.scale = 0.5;
  VirtualSession session(options);
  session.hand = brisk;
  for (int stop = 0; stop < 20; ++stop) {
    ASSERT_TRUE(session.grip());
    session.run(0.7 + 0.113 * stop);
    session.clutch = false;
    ASSERT_TRUE(session.run_until([&] { return session.at_rest(); }, 3.0));
    session.run(1.0);
    EXPECT_FALSE(session.spilled()) << "stop " << stop;
  }
  session.expect_safe();
}

/// How far the glass moves after the hand releases it, m, and how long that takes, s.
std::pair<double, double> coast(VirtualSession& session) {
  const double released = session.now();
  session.clutch = false;
  const Vector3 from = session.glass(session.last_command.q).p;
  EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 3.0));
  return {(session.glass(session.last_command.q).p - from).norm(), session.now() - released};
}

/// The glass turns less than a hand that the arm cannot reach, or follow: a release makes up for nothing of that.
TEST(Spill, AReleaseLeavesTheGlassNearWhereItWas) {
  for (const double side : {1.0, -1.0}) {
    VirtualSession session(with("carry"));
    double speed = 0.25 * side, since = 0.0;
    session.hand = [&](double t) { return Pose{Vector3(0.0, speed * (t - since), 0.0), Quaternion::Identity()}; };
    for (const double seconds : {4.5, 1.3, 1.3, 2.0}) {  // out of reach, and back
      session.run(1.0);
      since = session.now();
      ASSERT_TRUE(session.grip());
      session.run(seconds);
      const auto [way, time] = coast(session);
      EXPECT_LT(way, 0.15) << side << ", after " << seconds << " s";
      EXPECT_LT(time, 1.0) << side << ", after " << seconds << " s";
      if (seconds > 4.0) speed = -speed;
    }
    EXPECT_FALSE(session.spilled());
    session.expect_safe();
  }
}

/// The profile and the tilt change in motion; poured liquid may spill, and no other.
TEST(Spill, PouringIsAllowedAndNothingSteps) {
  VirtualSession session(with("carry"));
  session.hand = brisk;
  ASSERT_TRUE(session.grip());
  OperatorSettings settings;
  settings.scale = 0.5;
  for (int change = 0; change < 12; ++change) {
    settings.no_spill = change % 2 == 0;
    settings.tilt_max = settings.no_spill ? 0.1 * (change % 3) : M_PI;
    session.planner_side().settings.write(settings);
    session.run(0.4 + 0.07 * change);
  }
  session.expect_safe();
  EXPECT_EQ(session.state(), SupervisionState::kEngaged);
  settings.no_spill = true;
  settings.tilt_max = 0.0;
  session.planner_side().settings.write(settings);
  const Pose still = brisk(session.now());
  session.hand = [=](double) { return still; };
  session.run(4.0);
  EXPECT_GT((session.glass(session.last_command.q).q * Vector3::UnitZ()).z(), std::cos(0.05));
}

/// From upright to pouring and back while a hand moves that holds its glass level: what only moves spills nothing.
TEST(Spill, SwitchingBetweenUprightAndPouringSpillsNothing) {
  VirtualSession session(with("carry"));
  session.hand = [](double t) {
    Pose pose = brisk(0.6 * t);
    pose.q = Eigen::AngleAxisd(0.4 * std::sin(1.1 * t), Vector3::UnitZ());
    return pose;
  };
  ASSERT_TRUE(session.grip());
  OperatorSettings settings;
  settings.scale = 0.5;
  Pose before = session.glass(session.last_command.q);
  double fastest = 0.0;
  for (int change = 0; change < 20; ++change) {
    settings.no_spill = change % 2 == 1;
    settings.tilt_max = settings.no_spill ? 0.0 : M_PI;
    session.planner_side().settings.write(settings);
    for (int step = 0; step < 10; ++step) {
      session.run(0.03 + 0.002 * change);
      const Pose now = session.glass(session.last_command.q);
      fastest = std::max(fastest, (now.p - before.p).norm() / (0.03 + 0.002 * change));
      before = now;
    }
    EXPECT_FALSE(session.spilled()) << "change " << change;
  }
  EXPECT_GT(fastest, 0.1);  // m/s: it moves
  EXPECT_EQ(session.state(), SupervisionState::kEngaged);
  session.expect_safe();
}

/// Missed cycles: the arm continues by itself and brakes. Its liquid is that of its motion in every cycle.
TEST(Spill, StallsOfTwentyMillisecondsSpillNothing) {
  Monitor glass(ur5e(), GlassSettings{});
  VirtualSession::Options options = with("carry");
  options.scale = 0.5;
  options.make_arm = [&](Clock& clock) {
    return std::make_unique<WatchedArm>(ur5e(), SimulatedArmSettings{}, clock,
                                        [&](const JointState& state) { glass.update(state); });
  };
  VirtualSession session(options);
  session.hand = brisk;
  ASSERT_TRUE(session.grip());
  session.run(1.0);
  double fastest = 0.0;  // rad/s, as a stall begins
  for (int stall = 0; stall < 12; ++stall) {
    session.run(0.5 + 0.023 * stall);
    fastest = std::max(fastest, session.last_command.dq.cwiseAbs().maxCoeff());
    session.clock().advance(0.02);
    session.run(0.5);
    EXPECT_EQ(session.state(), SupervisionState::kEngaged);
    EXPECT_FALSE(glass.liquid().spilled) << "stall " << stall << ", share " << glass.liquid().spilled_share;
  }
  EXPECT_GT(fastest, 0.5);
  session.expect_safe();
}

/// A refill, another fill and a fresh grip: the liquid is at rest for the planner too.
TEST(Spill, ThePlannerKnowsOfAFreshGlass) {
  VirtualSession session(with("carry"));
  session.hand = brisk;
  const auto swing = [&] {  // m/s^2, of the mode in the middle about where it would be at rest
    const Vector3 down = session.glass(session.last_command.q).q.conjugate() * kGravity;
    const SloshState& state = session.planning().liquid();
    Eigen::Vector4d about = state.segment<4>(slosh_entry(1, 0));
    about[0] -= kGravity.z() / down.z() * down.x();
    about[slosh_entry(1, 1) - slosh_entry(1, 0)] -= kGravity.z() / down.z() * down.y();
    return about.norm();
  };
  std::optional<double> first;  // after the next planning step
  session.around_planner = [&](bool begins) {
    if (!begins && !first) first = swing();
  };
  const auto next = [&] {
    first.reset();
    session.run(0.021);
    return first.value_or(-1.0);
  };
  ASSERT_TRUE(session.grip());
  OperatorSettings settings;
  settings.no_spill = true;
  for (int i = 0; i < 6; ++i) {
    session.run(0.9 + 0.07 * i);
    EXPECT_GT(next(), 0.1) << i;
    if (i % 2 == 0) {
      session.refill();
    } else {
      settings.fill = 0.084 + 0.001 * i;
      session.set(settings);
    }
    EXPECT_NEAR(next(), 0.0, 1e-6) << i;
  }
  session.run(1.0);
  session.clutch = false;
  ASSERT_TRUE(session.run_until([&] { return session.at_rest(); }, 3.0));
  EXPECT_GT(next(), 0.1);
  ASSERT_TRUE(session.grip());
  EXPECT_LT(next(), 0.05);
  session.expect_safe();
}

}  // namespace
}  // namespace steadyhand
