#include "steadyhand/session/supervise/hand_gate.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>
#include <utility>

namespace steadyhand {
namespace {

constexpr Time kPeriod = std::chrono::milliseconds(11);

/// A hand that moves smoothly with its clutch closed, and a gate that hears it.
struct Hand {
  explicit Hand(const HandGateSettings& settings = {}) : gate(settings) {
    OperatorSample open = at(now);
    open.clutch = false;
    (void)gate.update(open, now);
    for (int i = 0; i < 20; ++i) EXPECT_EQ(say(next()), HandVerdict::kGood);
  }
  OperatorSample at(Time t) const {
    OperatorSample sample;
    sample.stamp = {t, t};
    sample.clutch = true;
    const double s = to_seconds(t);
    sample.X_operator_hand.p = Vector3(0.4 * std::sin(3.0 * s), 0.3 * std::cos(2.0 * s), 1.0);
    sample.X_operator_hand.q = Eigen::AngleAxisd(0.8 * std::sin(2.5 * s), Vector3(1, 2, 3).normalized());
    return sample;
  }
  OperatorSample next() { return at(now += kPeriod); }
  HandVerdict say(const OperatorSample& sample) { return gate.update(sample, now); }

  Time now{std::chrono::seconds(10)};
  HandGate gate;
};

TEST(HandGate, AGoodHandPassesAndItsGripIsCountedOnce) {
  Hand hand;
  EXPECT_TRUE(hand.gate.report().trusted);
  EXPECT_TRUE(hand.gate.report().clutch);
  EXPECT_EQ(hand.gate.report().grips, 1u);
  EXPECT_EQ(hand.gate.dropped(), 0u);
}

TEST(HandGate, NamesWhatIsWrongWithAPose) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto verdict = [](auto spoil, const HandGateSettings& settings = {}) {
    Hand hand(settings);
    OperatorSample sample = hand.next();
    spoil(sample);
    const HandVerdict v = hand.say(sample);
    EXPECT_EQ(hand.gate.report().trusted, v == HandVerdict::kGood);
    return v;
  };
  EXPECT_EQ(verdict([](OperatorSample& s) { s.tracked = false; }), HandVerdict::kUntracked);
  EXPECT_EQ(verdict([](OperatorSample& s) { s.emulated = true; }), HandVerdict::kEmulated);
  EXPECT_EQ(verdict([](OperatorSample& s) { s.emulated = true; }, {.accept_emulated = true}), HandVerdict::kGood);
  EXPECT_EQ(verdict([=](OperatorSample& s) { s.X_operator_hand.p.y() = nan; }), HandVerdict::kNotFinite);
  EXPECT_EQ(verdict([](OperatorSample& s) { s.X_operator_hand.p.z() = INFINITY; }), HandVerdict::kNotFinite);
  EXPECT_EQ(verdict([=](OperatorSample& s) { s.X_operator_hand.q.w() = nan; }), HandVerdict::kNotFinite);
  EXPECT_EQ(verdict([](OperatorSample& s) { s.X_operator_hand.q.coeffs() *= 2.0; }), HandVerdict::kNotFinite);
  EXPECT_EQ(verdict([](OperatorSample& s) { s.X_operator_hand.p.x() += 0.7; }), HandVerdict::kJump);
  EXPECT_EQ(verdict([](OperatorSample& s) {
              s.X_operator_hand.q = Quaternion(Eigen::AngleAxisd(1.5, Vector3::UnitX())) * s.X_operator_hand.q;
            }),
            HandVerdict::kJump);
}

TEST(HandGate, AfterAJumpTheHandIsTrustedNearWhereItWasLostAndNowhereElse) {
  Hand hand;
  OperatorSample away = hand.next();
  away.X_operator_hand.p.x() += 0.7;
  EXPECT_EQ(hand.say(away), HandVerdict::kJump);
  for (int i = 0; i < 2; ++i) {
    away = hand.next();
    away.X_operator_hand.p.x() += 0.7;
    EXPECT_EQ(hand.say(away), HandVerdict::kFarAway);
  }
  EXPECT_EQ(hand.say(hand.next()), HandVerdict::kUnsettled);
  EXPECT_EQ(hand.say(hand.next()), HandVerdict::kUnsettled);
  EXPECT_EQ(hand.say(hand.next()), HandVerdict::kGood);
  EXPECT_EQ(hand.gate.report().grips, 1u);
}

TEST(HandGate, AfterAJumpAHandThatComesBackTurnedIsNotTrusted) {
  Hand hand;
  for (int i = 0; i < 10; ++i) {
    OperatorSample turned = hand.next();
    turned.X_operator_hand.q = turned.X_operator_hand.q * Quaternion(Eigen::AngleAxisd(1.5, Vector3::UnitX()));
    EXPECT_EQ(hand.say(turned), i == 0 ? HandVerdict::kJump : HandVerdict::kFarAway);
  }
}

TEST(HandGate, AFreshGripIsTrustedAnywhere) {
  Hand hand;
  for (int i = 0; i < 5; ++i) {
    OperatorSample away = hand.next();
    away.X_operator_hand.p.x() += 2.0;
    EXPECT_NE(hand.say(away), HandVerdict::kGood);
  }
  for (const bool clutch : {false, true}) {
    OperatorSample away = hand.next();
    away.X_operator_hand.p.x() += 2.0;
    away.clutch = clutch;
    EXPECT_EQ(hand.say(away), HandVerdict::kGood);
  }
  EXPECT_EQ(hand.gate.report().grips, 2u);
}

TEST(HandGate, AfterAGapOnlyNearWhereItWasSeen) {
  for (const bool near : {true, false}) {
    Hand hand;
    const OperatorSample last = hand.at(hand.now);
    hand.now += std::chrono::milliseconds(300);
    OperatorSample back = last;
    if (!near) back.X_operator_hand.p.x() += 0.3;
    for (int i = 0; i < 3; ++i) {
      back.stamp.hand = back.stamp.made = hand.now += kPeriod;
      (void)hand.say(back);
    }
    EXPECT_EQ(hand.gate.report().verdict, near ? HandVerdict::kGood : HandVerdict::kFarAway);
  }
}

TEST(HandGate, RepeatedAndReorderedSamplesAreDroppedAndHarmless) {
  Hand hand;
  std::mt19937 random(2);
  std::uniform_int_distribution<int> age(0, 30);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(hand.say(hand.next()), HandVerdict::kGood);
    EXPECT_EQ(hand.say(hand.at(hand.now - age(random) * kPeriod)), HandVerdict::kOutOfOrder);
    EXPECT_TRUE(hand.gate.report().trusted);
  }
  EXPECT_EQ(hand.gate.dropped(), 1000u);
}

TEST(HandGate, WhatComesLateIsDropped) {
  Hand hand;
  const OperatorSample sample = hand.next();
  EXPECT_EQ(hand.gate.update(sample, hand.now + std::chrono::milliseconds(250)), HandVerdict::kStale);
  EXPECT_EQ(hand.gate.report().good, hand.now - kPeriod);
}

TEST(HandGate, AGripCountsAfterAnOpenClutchThatWasHeardLate) {
  Hand hand;
  hand.gate.forget();
  const std::uint64_t grips = hand.gate.report().grips;
  EXPECT_EQ(hand.say(hand.next()), HandVerdict::kGood);
  EXPECT_EQ(hand.gate.report().grips, grips);  // the gate never saw it open
  OperatorSample open = hand.next();
  open.clutch = false;
  EXPECT_EQ(hand.gate.update(open, hand.now + std::chrono::milliseconds(250)), HandVerdict::kStale);
  EXPECT_EQ(hand.say(hand.next()), HandVerdict::kGood);
  EXPECT_EQ(hand.gate.report().grips, grips + 1);
}

TEST(HandGate, LettingGoCountsHoweverLateAndInWhateverOrder) {
  const auto out_of_order = [](Hand& hand, OperatorSample& open) { open.stamp.hand = hand.now - 2 * kPeriod; };
  const auto stale = [](Hand& hand, OperatorSample&) { hand.now += std::chrono::milliseconds(250); };
  const auto clock_set = [](Hand&, OperatorSample& open) { open.stamp.hand += std::chrono::hours(1); };
  for (const std::function<void(Hand&, OperatorSample&)>& spoil :
       {std::function<void(Hand&, OperatorSample&)>(out_of_order), {stale}, {clock_set}}) {
    Hand hand;
    OperatorSample open = hand.next();
    open.clutch = false;
    spoil(hand, open);
    EXPECT_NE(hand.say(open), HandVerdict::kGood);
    EXPECT_FALSE(hand.gate.report().clutch);
  }
  // A late sample with an open clutch ends a grip, and starts none.
  Hand hand;
  OperatorSample open = hand.next();
  EXPECT_EQ(hand.say(open), HandVerdict::kGood);
  open.clutch = false;
  EXPECT_EQ(hand.say(open), HandVerdict::kOutOfOrder);
  for (int i = 0; i < 5; ++i) (void)hand.say(hand.next());
  EXPECT_FALSE(hand.gate.report().clutch);
  EXPECT_EQ(hand.gate.report().grips, 1u);
}

TEST(HandGate, AClockThatWasSetNeedsAFreshGrip) {
  for (const double step : {-3600.0, -2.0, 5.0}) {
    Hand hand;
    const Time offset = from_seconds(step);
    OperatorSample sample = hand.next();
    sample.stamp.hand += offset;
    EXPECT_EQ(hand.say(sample), HandVerdict::kClockStepped) << step;
    EXPECT_FALSE(hand.gate.report().trusted);
    EXPECT_FALSE(hand.gate.report().clutch);
    for (int i = 0; i < 10; ++i) (void)hand.say(hand.next());  // clutch still closed
    EXPECT_EQ(hand.gate.report().grips, 1u) << step;
  }
}

TEST(HandGate, AClientThatBeginsWithAClosedClutchHasToOpenIt) {
  HandGate gate;
  Hand source;
  for (int i = 0; i < 5; ++i) (void)gate.update(source.next(), source.now);
  EXPECT_EQ(gate.report().grips, 0u);
  EXPECT_FALSE(gate.report().clutch);
  OperatorSample open = source.next();
  open.clutch = false;
  (void)gate.update(open, source.now);
  (void)gate.update(source.next(), source.now);
  EXPECT_EQ(gate.report().grips, 1u);
  EXPECT_TRUE(gate.report().clutch);
}

/// For any input: within one grip a good pose is never further from the last good one than a hand can move in the time,
/// or than it may be when tracking returns.
TEST(HandGate, RandomPoses) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::bernoulli_distribution seldom(0.1);
  Hand hand;
  OperatorSample last = hand.at(hand.now);
  std::uint64_t grip = 0;
  int looked_at = 0, far = 0;
  for (int i = 0; i < 200000; ++i) {
    OperatorSample sample = hand.next();
    if (seldom(random)) sample.X_operator_hand.p += Vector3(unit(random), unit(random), unit(random));
    if (seldom(random)) sample.tracked = false;
    if (seldom(random)) sample.clutch = false;
    if (seldom(random)) sample.stamp.hand -= from_seconds(0.1 * unit(random) + 0.1);
    if (hand.say(sample) != HandVerdict::kGood || !sample.clutch) continue;
    if (std::exchange(grip, hand.gate.report().grips) == hand.gate.report().grips && hand.gate.report().clutch) {
      const double gap = to_seconds(sample.stamp.hand - last.stamp.hand);
      const double moved = (sample.X_operator_hand.p - last.X_operator_hand.p).norm();
      ASSERT_LE(moved, std::max(0.1, 0.02 + 6.0 * std::min(gap, 0.1)) + 1e-9);
      ++looked_at;
      far += moved > 0.05;
    }
    last = sample;
  }
  EXPECT_GT(looked_at, 50000);
  EXPECT_GT(far, 100);
}

}  // namespace
}  // namespace steadyhand
