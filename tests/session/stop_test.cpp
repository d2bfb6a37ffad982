// How a stop that was asked for brings the arm to rest.
#include "plan/straight_stop.hpp"
#include "session/virtual_session.hpp"

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
  EXPECT_FALSE(session.monitor().liquid().spilled);
  const Stop result{stop_time(ur5e(), session.last_command.dq), 0.0, false};
  const double begin = session.now();
  session.ask_stop();
  session.cycle();
  EXPECT_EQ(session.state(), SupervisionState::kStopping);
  if (twice) session.ask_stop();
  EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 2.0));
  const double took = session.now() - begin;
  session.run(1.0);
  session.expect_safe();
  return {result.shortest, took, session.monitor().liquid().spilled};
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
  EXPECT_GT(hard_spills, 0);  // so there was something to spare
}

TEST(AskedStop, WithoutAPlannerIsInTimeToo) {
  VirtualSession session;
  session.hand = sweeping({0.1, 0.1, 0.1});
  session.run(0.2);
  ASSERT_TRUE(session.grip());
  session.run(1.0);
  session.planner_runs = false;
  const double shortest = stop_time(ur5e(), session.last_command.dq), begin = session.now();
  session.ask_stop();
  EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 2.0));
  EXPECT_LE(session.now() - begin, shortest + 0.5 + 0.02);
  session.expect_safe();
}

}  // namespace
}  // namespace steadyhand
