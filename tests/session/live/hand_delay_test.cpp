#include "steadyhand/session/live/hand_delay.hpp"

#include <gtest/gtest.h>

#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using std::chrono::milliseconds;

OperatorSample at(Time t) {
  OperatorSample sample;
  sample.stamp = {t, t + milliseconds(3)};
  sample.X_operator_hand.p.x() = to_seconds(t);
  return sample;
}

TEST(HandDelay, ASampleComesLateAndIsNewThen) {
  HandDelay delay;
  delay.set(milliseconds(400));
  delay.push(at(milliseconds(1000)));
  OperatorSample sample;
  EXPECT_FALSE(delay.pop(milliseconds(1402), sample));
  ASSERT_TRUE(delay.pop(milliseconds(1403), sample));
  EXPECT_EQ(sample.stamp.hand, milliseconds(1400));
  EXPECT_EQ(sample.stamp.made, milliseconds(1403));
  EXPECT_EQ(sample.X_operator_hand.p.x(), 1.0);
  EXPECT_FALSE(delay.pop(milliseconds(9000), sample));
}

TEST(HandDelay, WithoutADelayASampleGoesThroughAtOnceWhateverItsStamps) {
  HandDelay delay;
  OperatorSample sample;
  delay.push(at(milliseconds(50)));
  ASSERT_TRUE(delay.pop(milliseconds(0), sample));
  EXPECT_EQ(sample.stamp.hand, milliseconds(50));
}

TEST(HandDelay, KeepsTheOrderAndTheNewestAndForgetsWhenItChanges) {
  HandDelay delay;
  delay.set(std::chrono::hours(1));  // cut to the longest
  OperatorSample sample;
  for (int i = 0; i < 1000; ++i) delay.push(at(milliseconds(i)));
  int last = -1, count = 0;
  while (delay.pop(HandDelay::kLongest + milliseconds(1000 + 3), sample)) {
    const int now = static_cast<int>(sample.X_operator_hand.p.x() * 1000.0 + 0.5);
    EXPECT_GT(now, last);
    last = now;
    ++count;
  }
  EXPECT_EQ(last, 999);
  EXPECT_EQ(count, 256);
  delay.push(at(milliseconds(0)));
  delay.set(milliseconds(10));
  EXPECT_FALSE(delay.pop(std::chrono::hours(1), sample));
}

/// s from where the hand begins to move to where the commands do.
double answers_after(double latency) {
  VirtualSession session;
  OperatorSettings settings;
  settings.latency = latency;
  session.set(settings);
  EXPECT_TRUE(session.grip());
  session.run(0.6);  // the ramp of the grip
  double begin = -1.0, moved = -1.0, t = 0.0;
  session.hand = [&](double now) {
    if (begin < 0.0) begin = now;
    Pose X;
    X.p.y() = 0.2 * std::min(now - begin, 0.5);
    t = now;
    return X;
  };
  session.on_command = [&](const JointCommand& command) {
    if (moved < 0.0 && (command.q - ur5e().home).cwiseAbs().maxCoeff() > 2e-3) moved = t;
  };
  session.run(1.0);
  EXPECT_GT(moved, 0.0);
  session.clutch = false;
  session.run(0.1);
  EXPECT_NE(session.state(), SupervisionState::kEngaged) << "a release is not late";
  return moved - begin;
}

TEST(HandDelay, InASessionTheArmIsLateByItAndAReleaseIsNot) {
  const double now = answers_after(0.0), late = answers_after(0.4);
  EXPECT_LT(now, 0.3);
  EXPECT_NEAR(late - now, 0.4, 0.04);
}

}  // namespace
}  // namespace steadyhand
