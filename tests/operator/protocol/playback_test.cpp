#include "steadyhand/operator/protocol/playback.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace steadyhand {
namespace {

/// A hand that ends elsewhere than it began, over a second at 100 Hz.
Recording away() {
  Recording recording;
  for (int i = 0; i <= 100; ++i) {
    OperatorSample sample;
    sample.stamp.hand = sample.stamp.made = i * Time(std::chrono::milliseconds(10));
    sample.X_operator_hand.p = Vector3(0.3 * std::sin(0.01 * i), 0.2, 1.0);
    sample.X_operator_hand.q = Eigen::AngleAxisd(0.005 * i, Vector3::UnitZ());
    sample.clutch = true;
    recording.samples.push_back(sample);
  }
  return recording;
}

TEST(Playback, GripsLeadsReturnsAndLetsGoAgainAndAgainWithoutAJump) {
  const Recording recording = away();
  const Time start = std::chrono::seconds(50);
  Playback playback(recording, start);
  OperatorSample last, sample;
  int grips = 0, releases = 0;
  double farthest = 0.0;
  for (Time now = start; playback.rounds() < 3; now += std::chrono::milliseconds(1)) {
    while (playback.next(now, sample)) {
      EXPECT_LE(sample.stamp.hand, now);
      EXPECT_GT(sample.stamp.hand, last.stamp.hand);
      if (last.stamp.hand > Time(0)) {
        const double dt = to_seconds(sample.stamp.hand - last.stamp.hand);
        EXPECT_LT(dt, 0.03) << "a hand that falls silent lets go";
        EXPECT_LT((sample.X_operator_hand.p - last.X_operator_hand.p).norm(), 0.002 + 1.0 * dt);
        EXPECT_LT(sample.X_operator_hand.q.angularDistance(last.X_operator_hand.q), 0.002 + 2.0 * dt);
      }
      const double from_first = (sample.X_operator_hand.p - recording.samples.front().X_operator_hand.p).norm();
      farthest = std::max(farthest, from_first);
      if (sample.clutch != last.clutch) {
        ++(sample.clutch ? grips : releases);
        EXPECT_LT(from_first, 1e-6) << "it begins and ends where the recording begins";
      }
      last = sample;
    }
    ASSERT_LT(now, start + std::chrono::seconds(60));
  }
  EXPECT_EQ(grips, 3);
  EXPECT_EQ(releases, 3);
  EXPECT_NEAR(farthest, 0.3 * std::sin(1.0), 1e-6);
}

/// If a busy machine costs it the grip, the hand releases, engages where it is, and continues the round from there.
TEST(Playback, GripsAnewWhereItIsAndGoesOn) {
  const Recording recording = away();
  for (const double lost_at : {1.7, 2.6}) {  // s: in the recording, and on the way back
    Playback playback(recording, Time(0));
    OperatorSample last, sample;
    std::vector<double> releases, grips;
    for (Time now{0}; playback.rounds() < 1; now += std::chrono::milliseconds(1)) {
      if (now == from_seconds(lost_at)) {
        EXPECT_NEAR(to_seconds(playback.closed_for(now)), lost_at - 0.4, 0.02);
        playback.grip_anew(now);
        playback.grip_anew(now);  // one is enough
        EXPECT_EQ(playback.closed_for(now), Time(0));
      }
      while (playback.next(now, sample)) {
        const double dt = to_seconds(sample.stamp.hand - last.stamp.hand);
        EXPECT_GT(dt, 0.0);
        EXPECT_LT(dt, 0.03);
        if (last.stamp.hand > Time(0)) {
          EXPECT_LT((sample.X_operator_hand.p - last.X_operator_hand.p).norm(), 0.002 + 1.0 * dt);
        }
        if (sample.clutch != last.clutch) (sample.clutch ? grips : releases).push_back(to_seconds(sample.stamp.hand));
        last = sample;
      }
      ASSERT_LT(now, from_seconds(20.0));
    }
    ASSERT_EQ(releases.size(), 2u);
    ASSERT_EQ(grips.size(), 2u);
    EXPECT_NEAR(releases[0], lost_at, 0.03);
    EXPECT_NEAR(grips[1] - releases[0], 0.4, 0.03);
    EXPECT_NEAR(releases[1], 4.0 + 1.0, 0.05) << "all of the round, and the pause";
    EXPECT_LT((last.X_operator_hand.p - recording.samples.front().X_operator_hand.p).norm(), 1e-6);
  }
}

/// If the tool is elsewhere, playback first moves it once to where the recording belongs.
TEST(Playback, GoesItsWayFirst) {
  const Recording recording = away();
  const Pose first = recording.samples.front().X_operator_hand;
  std::vector<Pose> way(201, first);
  for (int i = 0; i <= 200; ++i) way[i].p.y() = first.p.y() - 0.001 * (200 - i);
  Playback playback(recording, Time(0), PerTool<std::vector<Pose>>{way});
  OperatorSample last, sample;
  std::vector<Pose> grips;
  for (Time now{0}; playback.rounds() < 2; now += std::chrono::milliseconds(1)) {
    while (playback.next(now, sample)) {
      if (sample.clutch && !last.clutch) grips.push_back(sample.X_operator_hand);
      if (last.clutch) {
        EXPECT_LT((sample.X_operator_hand.p - last.X_operator_hand.p).norm(), 0.02);
      }
      last = sample;
    }
    ASSERT_LT(now, from_seconds(20.0));
  }
  ASSERT_EQ(grips.size(), 2u);
  EXPECT_LT((grips[0].p - way.front().p).norm(), 1e-9);
  EXPECT_LT((grips[1].p - first.p).norm(), 1e-9) << "the second round begins where the first one ended";
}

/// Two hands, of which the second comes later, ends earlier, and is seen half as often.
Recording both() {
  Recording recording = away();
  std::vector<OperatorSample> all;
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    all.push_back(recording.samples[i]);
    if (i % 2 != 0 || i < 30 || i > 70) continue;
    all.push_back(recording.samples[i]);
    all.back().tool = 1;
    all.back().X_operator_hand.p.y() = 0.3 + 0.002 * static_cast<double>(i);
  }
  recording.samples = all;
  return recording;
}

/// None of the hands falls silent or jumps; both grip and release together, wherever a busy machine costs them the
/// grip.
TEST(Playback, PlaysTwoHandsAtOnce) {
  const Recording recording = both();
  const Pose first = std::find_if(recording.samples.begin(), recording.samples.end(), [](const OperatorSample& sample) {
                       return sample.tool == 1;
                     })->X_operator_hand;
  PerTool<std::vector<Pose>> ways;
  ways[1].assign(101, first);
  for (int i = 0; i <= 100; ++i) ways[1][i].p.z() += 0.001 * (100 - i);
  for (const double lost_at : {100.0, 1.3, 2.4, 2.7, 4.0}) {
    Playback playback(recording, Time(0), ways);
    PerTool<std::vector<OperatorSample>> heard;
    OperatorSample sample;
    for (Time now{0}; playback.rounds() < 2; now += std::chrono::milliseconds(1)) {
      if (now == from_seconds(lost_at)) {
        EXPECT_GT(playback.closed_for(now, 0), Time(0));
        EXPECT_GT(playback.closed_for(now, 1), Time(0));
        playback.grip_anew(now);
        playback.grip_anew(now);
      }
      while (playback.next(now, sample)) heard[sample.tool].push_back(sample);
      ASSERT_GT(playback.due(), now);
      ASSERT_LT(now, from_seconds(20.0));
    }
    PerTool<std::vector<double>> turns;
    for (int t = 0; t < 2; ++t) {
      ASSERT_GT(heard[t].size(), 100u);
      for (std::size_t i = 1; i < heard[t].size(); ++i) {
        const OperatorSample &before = heard[t][i - 1], &now = heard[t][i];
        const double dt = to_seconds(now.stamp.hand - before.stamp.hand);
        EXPECT_GT(dt, 0.0);
        EXPECT_LT(dt, 0.035) << t << " at " << to_seconds(now.stamp.hand);
        if (before.clutch && now.clutch) {
          EXPECT_LT((now.X_operator_hand.p - before.X_operator_hand.p).norm(), 0.003 + 1.0 * dt);
        }
        if (now.clutch != before.clutch) turns[t].push_back(to_seconds(now.stamp.hand));
      }
      EXPECT_EQ(turns[t].size(), lost_at < 100.0 ? 6u : 4u);
    }
    ASSERT_EQ(turns[0].size(), turns[1].size());
    for (std::size_t i = 0; i < turns[0].size(); ++i) EXPECT_NEAR(turns[0][i], turns[1][i], 0.025) << i;
  }
}

/// Between two places at the sides of the arm, and at its back.
TEST(WayAroundBase, KeepsItsDistanceFromTheAxisAndItsSpeed) {
  const auto at = [](double r, double angle, double z) {
    return Pose{{r * std::cos(angle), r * std::sin(angle), z}, Quaternion(Eigen::AngleAxisd(angle, Vector3::UnitZ()))};
  };
  const double dt = to_seconds(Playback::kPeriod);
  for (const auto& [from, to] : {std::pair(at(0.5, 1.5, 0.4), at(0.6, -1.5, 0.2)),
                                 {at(0.3, 3.0, 0.1), at(0.4, -3.0, 0.1)},
                                 {at(0.0, 0.0, 0.9), at(0.5, 1.0, 0.3)},
                                 {at(0.5, 0.0, 0.3), at(0.5, 0.02, 0.3)}}) {
    const std::vector<Pose> way = way_around_base(from, to);
    ASSERT_GT(way.size(), 1u);
    EXPECT_LT((way.front().p - from.p).norm() + (way.back().p - to.p).norm(), 1e-12);
    EXPECT_LT(way.back().q.angularDistance(to.q), 1e-6);
    const double nearest = std::min(from.p.head<2>().norm(), to.p.head<2>().norm());
    for (std::size_t i = 1; i < way.size(); ++i) {
      EXPECT_GE(way[i].p.head<2>().norm(), nearest - 1e-9);
      EXPECT_LT((way[i].p - way[i - 1].p).norm(), 1.01 * kWaySpeed * dt);
      EXPECT_LT(way[i].q.angularDistance(way[i - 1].q), 1.01 * kWayTurnRate * dt);
    }
  }
  EXPECT_TRUE(way_around_base(at(0.5, 1.0, 0.3), at(0.502, 1.0, 0.3)).empty());
}

}  // namespace
}  // namespace steadyhand
