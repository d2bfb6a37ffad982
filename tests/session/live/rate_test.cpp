// How often plans are made, and what that means for the way from hand to command.
#include <fmt/format.h>

#include "steadyhand/session/live/sustained_rate.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

TEST(SustainedRate, IsTheFastestFractionOfTheArmsRateThatLeavesRoom) {
  EXPECT_EQ(sustained_rate(500.0, 100.0), 500.0);
  EXPECT_EQ(sustained_rate(500.0, 800.0), 500.0);
  EXPECT_EQ(sustained_rate(500.0, 801.0), 250.0);
  EXPECT_EQ(sustained_rate(500.0, 3000.0), 125.0);
  EXPECT_EQ(sustained_rate(500.0, 5000.0), 50.0);
  EXPECT_EQ(sustained_rate(125.0, 100.0), 125.0);
  EXPECT_GE(sustained_rate(500.0, 1e9), 4.0);
  double last = 500.0;
  for (double us = 10.0; us < 1e6; us *= 1.1) {
    const double rate = sustained_rate(500.0, us);
    EXPECT_LE(rate, last);
    EXPECT_GE(rate, 4.0);
    last = rate;
  }
}

/// Of steps that all take the same, from a time on: the rate after `seconds` of them. us, s
double keep(RateKeeper& keeper, double us, double seconds, Time& now) {
  for (const Time end = now + from_seconds(seconds); now < end;) {
    now += from_seconds(std::max(1e-6 * us, 1.0 / keeper.rate_hz()));
    (void)keeper.take(us, now);
  }
  return keeper.rate_hz();
}

TEST(RateKeeper, IsSlowerWithinAHundredMillisecondsAndFasterAfterCalmSeconds) {
  RateKeeper keeper(500.0, 16.0, 500.0);
  Time now = std::chrono::hours(9);
  EXPECT_EQ(keep(keeper, 700.0, 20.0, now), 500.0);
  EXPECT_EQ(keep(keeper, 3000.0, 0.1, now), 125.0);
  EXPECT_EQ(keep(keeper, 700.0, 4.0, now), 125.0);
  EXPECT_EQ(keep(keeper, 700.0, 2.0, now), 500.0);
  EXPECT_EQ(keep(keeper, 1e6, 60.0, now), 16.0) << "where supervision would take it for late";
}

TEST(RateKeeper, StaysWhereOneStepInTwentyIsSlow) {
  RateKeeper keeper(500.0, 16.0, 500.0);
  for (int i = 0; i < 20000; ++i) EXPECT_FALSE(keeper.take(i % 20 == 7 ? 20e3 : 700.0, i * from_seconds(0.002)));
}

TEST(RateKeeper, IsNotFasterBetweenSlowPlacesOfOneMotion) {
  RateKeeper keeper(500.0, 16.0, 500.0);
  Time now{0};
  ASSERT_EQ(keep(keeper, 3000.0, 0.2, now), 125.0);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(keep(keeper, 700.0, 4.0, now), 125.0);
    EXPECT_EQ(keep(keeper, 3000.0, 0.4, now), 125.0);
  }
  EXPECT_EQ(keep(keeper, 1500.0, 12.0, now), 250.0) << "as fast as the slowest of the calm bears";
}

TEST(SustainedRate, IsMeasuredWithThePlannerThatIsUsed) {
  PlanningSettings settings;
  settings.ocp = load_profile("waiter")->ocp;
  const MonotonicClock clock;
  const Result<double> us = measure_planning_us(ur5e(), settings, clock);
  ASSERT_TRUE(us) << us.error().message;
  EXPECT_GT(*us, 0.0);
  settings.planner.solver = "magic";
  EXPECT_FALSE(measure_planning_us(ur5e(), settings, clock));
}

/// Plans begin at control cycles and are made just after one: what is left between hand and command is the wait for the
/// planner and a cycle or two.
TEST(HandToCommand, TakesAPeriodAndTwoMillisecondsAtMostInTheMedian) {
  for (const double rate : {50.0, 100.0, 250.0, 500.0}) {
    VirtualSession session(VirtualSession::Options::at_rate(rate));
    session.lead(sweeping({0.1, 0.1, 0.05}), 1.5);
    constexpr double kBin = 1.03;  // width of the histogram's bins
    const TimingSummary us = session.latency_us();
    EXPECT_LE(us.p50, kBin * (1e6 / rate + 2000.0)) << rate;
    EXPECT_LE(us.p99, kBin * 2e6 / rate) << rate;
    EXPECT_GT(us.p50, 0.0);
    EXPECT_EQ(session.view.rejected_plans, 0u) << rate;
    session.expect_safe();
  }
}

}  // namespace
}  // namespace steadyhand
