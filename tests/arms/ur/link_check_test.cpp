// Whether a link is fit, from arrivals that are made up; and the clock that such arrivals give.
#include <gtest/gtest.h>

#include <random>

#include "steadyhand/arms/ur/ur_link_check.hpp"

namespace steadyhand {
namespace {

/// 20 s of a controller at 500 Hz whose packages take `delay(i)` s each way.
template <typename Delay>
UrLinkReport measure(const Delay& delay, int lost_every = 0) {
  UrLinkMeter meter(500.0);
  Time last{0};
  std::int32_t echo = 0, newest = 0;
  for (int i = 1; i <= 10000; ++i) {
    if (lost_every > 0 && i % lost_every == 0) continue;
    const Time arrival = std::max(last + Time(1000), from_seconds(50.0 + 0.002 * i + delay(i)));
    last = arrival;
    meter.package(arrival, 1000.0 + 0.002 * i, echo);
    echo = newest;  // what was sent before reaches the controller by the next cycle
    newest = meter.send(arrival);
    meter.woke(std::chrono::microseconds(20));
  }
  return meter.report();
}

TEST(UrLink, AQuietLinkIsFit) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(0.0, 2e-4);
  const UrLinkReport r = measure([&](int) { return 3e-4 + jitter(random); });
  EXPECT_EQ(r.packages, 10000u);
  EXPECT_EQ(r.skipped, 0u);
  EXPECT_NEAR(r.seconds, 20.0, 0.01);
  EXPECT_LT(r.late.max, 260.0);
  EXPECT_NEAR(r.round_trip.p50, 4000.0, 300.0);
  EXPECT_EQ(judge(r, 2, 0.05).verdict, UrLinkVerdict::kFit);
  EXPECT_TRUE(judge(r, 2, 0.05).findings.empty());
}

TEST(UrLink, RareDelaysWantCareAndLongOnesAreUnfit) {
  const auto with = [](double seconds) {
    return judge(measure([=](int i) { return i % 5000 == 4000 ? seconds : 3e-4; }), 2, 0.05).verdict;
  };
  EXPECT_EQ(with(0.003), UrLinkVerdict::kFit);
  EXPECT_EQ(with(0.015), UrLinkVerdict::kFitWithCare);
  EXPECT_EQ(with(0.060), UrLinkVerdict::kUnfit);
}

TEST(UrLink, SaysWhatToChange) {
  const auto says = [](const UrLinkReport& r, const char* word) {
    for (const std::string& line : judge(r, 2, 0.05).findings) {
      if (line.find(word) != std::string::npos) return true;
    }
    return false;
  };
  UrLinkReport r = measure([](int) { return 3e-4; });
  r.wake.max = r.wake.p999 = 5000.0;
  EXPECT_TRUE(says(r, "real-time"));
  r = measure([](int) { return 3e-4; });
  r.retransmitted = 3;
  EXPECT_TRUE(says(r, "Wi-Fi"));
  r = measure([](int) { return 3e-4; }, 50);
  EXPECT_EQ(r.skipped, 199u);
  EXPECT_TRUE(says(r, "left out"));
  r = measure([](int i) { return i % 1000 < 20 ? 0.02 : 3e-4; });
  EXPECT_TRUE(says(r, "network"));
  EXPECT_EQ(judge(UrLinkReport{}, 2, 0.05).verdict, UrLinkVerdict::kUnfit);
}

TEST(OffsetFilter, FollowsDriftEvenlyThroughJitter) {
  std::mt19937 random(2);
  std::exponential_distribution<double> late(1.0 / 5e-4);
  OffsetFilter filter;
  Time last{0}, last_theirs{0};
  for (int i = 0; i < 20000; ++i) {
    const Time theirs = from_seconds(0.002 * i);
    const double now = 7.0 + 0.002 * i * (1.0 + 3e-5);  // clocks that drift by 30 ppm
    const Time made = filter.update(theirs, from_seconds(now + late(random)), i < 1000);
    if (i > 1000) {
      const double step = to_seconds(made - last) / to_seconds(theirs - last_theirs);
      EXPECT_NEAR(step, 1.0, 1.01e-4);
      EXPECT_NEAR(to_seconds(made), now, 4e-4);
    }
    last = made;
    last_theirs = theirs;
  }
}

}  // namespace
}  // namespace steadyhand
