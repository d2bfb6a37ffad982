// How a stop that was asked for brings the arm to rest.
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

struct Stop {
  double shortest = 0.0;  ///< s, at the limits
  double took = 0.0;      ///< s until rest
  bool spilled = false;   ///< from the stop on
};

/// Stops an arm that has followed a hand for `after` s. Asked twice, the stop is the shortest.
Stop stop(double after, bool twice) {
  VirtualSession session;
  session.hand = sweeping({0.1, 0.1, 0.1});
  session.run(0.2);
  EXPECT_TRUE(session.grip());
  session.run(after);
  EXPECT_EQ(session.state(), SupervisionState::kEngaged);
  EXPECT_FALSE(session.spilled());
  const Stop result{stop_time(ur5e(), session.last_command.dq), 0.0, false};
  const double begin = session.now();
  session.ask_stop();
  session.cycle();
  EXPECT_EQ(session.state(), SupervisionState::kStopping);
  if (twice) session.ask_stop();
  EXPECT_TRUE(session.run_until([&] { return session.last_command.dq.isZero(); }, 2.0));
  const double took = session.now() - begin;
  session.run(1.0);
  EXPECT_TRUE(session.at_rest());
  session.expect_safe();
  return {result.shortest, took, session.spilled()};
}

TEST(AskedStop, SparesTheLiquidWithinHalfASecondMoreThanTheShortest) {
  int soft_spills = 0, hard_spills = 0;
  for (const double after : {1.0, 1.3, 1.6, 1.9}) {
    const Stop soft = stop(after, false), hard = stop(after, true);
    EXPECT_LE(soft.took, soft.shortest + 0.5 + 0.02);
    EXPECT_LE(hard.took, hard.shortest + 0.02);
    soft_spills += soft.spilled;
    hard_spills += hard.spilled;
  }
  EXPECT_EQ(soft_spills, 0);
  EXPECT_GT(hard_spills, 0);  // hard stops do spill
}

/// The arm stops slightly later than its commands do: a reset in between must not make it jump to where it is.
TEST(AskedStop, IsResetOnceTheArmStands) {
  VirtualSession session;
  session.lead(sweeping({0.1, 0.1, 0.1}), 1.0);
  session.ask_stop();
  session.ask_stop();
  double step = 0.0;
  for (int i = 0; i < 1000 && session.state() != SupervisionState::kIdle; ++i) {
    const JointVector before = session.last_command.q;
    session.ask_reset();
    session.cycle();
    step = (session.last_command.q - before).cwiseAbs().maxCoeff();
  }
  ASSERT_EQ(session.state(), SupervisionState::kIdle);
  EXPECT_LT(step, 3e-4);  // rad: what is left of 0.02 rad/s and a lag of 10 ms
}

TEST(AskedStop, WithoutAPlannerIsInTimeToo) {
  VirtualSession session;
  session.lead(sweeping({0.1, 0.1, 0.1}), 1.0);
  session.planner_runs = false;
  const double shortest = stop_time(ur5e(), session.last_command.dq), begin = session.now();
  session.ask_stop();
  EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 2.0));
  EXPECT_LE(session.now() - begin, shortest + 0.5 + 0.02);
  session.expect_safe();
}

/// At rest in this state, with the hand closed as it was.
void bring_to(VirtualSession& session, SupervisionState state) {
  session.lead(sweeping({0.1, 0.1, 0.1}), 0.5);
  if (state == SupervisionState::kFault) {
    session.arm().trip("emergency button");
  } else {
    session.ask_stop();
  }
  ASSERT_TRUE(session.run_until([&] { return session.at_rest() && session.state() == state; }, 2.0));
}

/// In any order and from any number of threads: between two cycles a reset never wins.
TEST(AskedStop, BesideAResetAlwaysWinsAndStays) {
  for (const SupervisionState state : {SupervisionState::kStopping, SupervisionState::kFault}) {
    for (const char* order : {"rs", "sr", "rsr", "srs", "rr s", "r s", "s r", "s rr"}) {  // blank: a cycle passes
      SCOPED_TRACE(std::string(to_string(state)) + " " + order);
      VirtualSession session;
      bring_to(session, state);
      for (const char* asked = order; *asked != 0; ++asked) {
        if (*asked == 'r') session.ask_reset();
        if (*asked == 's') session.ask_stop();
        if (*asked == ' ') session.cycle();
      }
      // A reset that knew of the stop counts, and no other.
      const bool considered = std::string(order) == "s r" || std::string(order) == "s rr";
      const JointVector q = session.last_command.q;
      session.run(0.1);
      EXPECT_EQ(session.state() == SupervisionState::kReady, considered) << to_string(session.state());
      if (considered) continue;
      EXPECT_TRUE(session.state() == SupervisionState::kStopping || session.state() == SupervisionState::kFault);
      EXPECT_FALSE(session.grip());
      EXPECT_LT((session.last_command.q - q).norm(), 1e-9);
      session.ask_reset();
      EXPECT_TRUE(session.run_until([&] { return session.state() == SupervisionState::kReady; }, 0.5));
    }
  }
}

TEST(AskedStop, EndsAResetThatStillWaitsForRest) {
  VirtualSession session;
  session.lead(sweeping({0.1, 0.1, 0.1}), 1.0);
  session.ask_stop();
  session.cycle();
  ASSERT_FALSE(session.at_rest());
  session.ask_reset();
  session.cycle();
  session.ask_stop();
  session.run(2.0);
  EXPECT_EQ(session.state(), SupervisionState::kStopping);
  session.expect_safe();
}

TEST(AskedStop, AResetUndoesOneFaultAndNotTheNext) {
  VirtualSession session;
  bring_to(session, SupervisionState::kFault);
  session.ask_reset();
  ASSERT_TRUE(session.run_until([&] { return session.state() == SupervisionState::kReady; }, 0.5));
  session.ask_reset();  // of nothing
  session.cycle();
  session.arm().trip("again");
  session.run(1.0);
  EXPECT_EQ(session.state(), SupervisionState::kFault);
}

/// An arm that hardly moves is at rest in no time; what was planned for that is followed for as long as any other plan.
TEST(AskedStop, AtNearlyNoSpeedIsAStopAsAnyOther) {
  VirtualSession session;
  session.hand = sweeping(Vector3::Constant(1e-9));
  session.run(0.2);
  for (const double apart : {0.002, 0.01, 0.05, 0.1}) {
    ASSERT_TRUE(session.grip());
    ASSERT_TRUE(session.run_until([&] { return session.last_command.dq.norm() > 0.0; }, 1.0));
    session.ask_stop();
    session.run(apart);
    session.ask_stop();
    session.run(10.0);
    EXPECT_EQ(session.state(), SupervisionState::kStopping);
    EXPECT_TRUE(session.at_rest());
    session.ask_reset();
    ASSERT_TRUE(session.run_until([&] { return session.state() == SupervisionState::kReady; }, 1.0));
    session.run(10.0);
  }
  session.expect_safe();
}

}  // namespace
}  // namespace steadyhand
