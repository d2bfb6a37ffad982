#include "steadyhand/planning/predict/predictor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace steadyhand {
namespace {

struct Motion {
  Vector3 p, v, w;
  Quaternion q;

  Target at(double t) const {
    Target target;
    target.stamp = {from_seconds(t), from_seconds(t)};
    target.X_base_tool = {p + t * v, rotation(t * w) * q};
    target.engaged = true;
    return target;
  }
};

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  double normal(double sigma) { return std::normal_distribution<double>(0.0, sigma)(engine_); }
  Vector3 vector(double bound) { return {uniform(-bound, bound), uniform(-bound, bound), uniform(-bound, bound)}; }
  Motion motion() { return {vector(0.5), vector(1.0), vector(3.0), rotation(vector(3.0))}; }

 private:
  std::mt19937 engine_;
};

TEST(RotationVector, RoundTrips) {
  Random random(1);
  for (int i = 0; i < 100'000; ++i) {
    const Vector3 v = random.vector(i % 3 == 0 ? 1e-9 : 1.7);
    EXPECT_LT((rotation_vector(rotation(v)) - v).norm(), 1e-12);
    const Quaternion negated(Eigen::Vector4d(-rotation(v).coeffs()));
    EXPECT_LT((rotation_vector(negated) - v).norm(), 1e-12);
  }
}

/// A device that predicts its own poses, by a varying time, moves the arm no further than one that does not.
TEST(Predictor, TakesOffWhatTheDevicePredicted) {
  Random random(9);
  for (int trial = 0; trial < 200; ++trial) {
    const Motion motion = random.motion();
    Predictor predictor({});
    double t = 0.0;
    for (int i = 0; i < 20; ++i) {
      t += random.uniform(0.008, 0.02);
      const double look_ahead = random.uniform(0.02, 0.03);
      Target target = motion.at(t + look_ahead);
      target.stamp = {from_seconds(t), from_seconds(t)};
      target.look_ahead = from_seconds(look_ahead);
      predictor.update(target);
    }
    const Time now = from_seconds(t + 0.01);
    EXPECT_LT((predictor.at(now).p - motion.at(t + 0.01).X_base_tool.p).norm(), 1e-6);
    EXPECT_EQ(predictor.predict(now).stamp.hand, from_seconds(t));
  }
}

/// A hand that moves at constant velocities is predicted exactly, however uneven the stamps.
TEST(Predictor, ExactOnConstantMotion) {
  Random random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    const Motion motion = random.motion();
    Predictor predictor({});
    double t = 0.0;
    for (int i = 0; i < 20; ++i) predictor.update(motion.at(t += random.uniform(0.004, 0.02)));
    const Time start = from_seconds(t + random.uniform(0.0, 0.05));
    const Reference reference = predictor.predict(start);
    ASSERT_EQ(reference.nodes, 8);
    for (int k = 0; k < 8; ++k) {
      const Target expected = motion.at(to_seconds(start) + (k + 1) * 0.05);
      EXPECT_LT((reference.tools[0].p[k] - expected.X_base_tool.p).norm(), 1e-6);
      EXPECT_LT((reference.tools[0].R[k] - expected.X_base_tool.q.toRotationMatrix()).norm(), 1e-5);
    }
  }
}

/// No bias, and the variance sigma^2 sum(h_i^2) of the line's slope, where h_i is how much target i counts: its
/// velocity after a pulse in that target alone.
TEST(Predictor, NoiseIsAveraged) {
  Random random(3);
  const double sigma = 1e-3;  // m
  const int samples = 20, trials = 4000;
  for (const double rate : {60.0, 90.0, 120.0}) {
    double gain = 0.0;
    for (int pulse = 0; pulse < samples; ++pulse) {
      Predictor predictor({});
      for (int i = 0; i < samples; ++i) {
        Target target = Motion{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, Quaternion::Identity()}.at(i / rate);
        target.X_base_tool.p.x() = i == pulse ? 1.0 : 0.0;
        predictor.update(target);
      }
      gain += predictor.velocity().squaredNorm();
    }
    const double expected = sigma * std::sqrt(gain);
    EXPECT_LT(expected, 0.05) << rate << " Hz";  // m/s, for a hand that is seen to 1 mm

    double sum = 0.0, squares = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      const Motion motion = random.motion();
      Predictor predictor({});
      for (int i = 0; i < samples; ++i) {
        Target target = motion.at(i / rate);
        for (int c = 0; c < 3; ++c) target.X_base_tool.p[c] += random.normal(sigma);
        predictor.update(target);
      }
      const double error = predictor.velocity().x() - motion.v.x();
      sum += error;
      squares += error * error;
    }
    EXPECT_LT(std::abs(sum / trials), 4.0 * expected / std::sqrt(trials)) << rate << " Hz";
    EXPECT_NEAR(std::sqrt(squares / trials), expected, 0.1 * expected) << rate << " Hz";
  }
}

TEST(Predictor, ExactAtAnyRate) {
  Random random(9);
  for (const double rate : {10.0, 20.0, 30.0, 60.0, 120.0, 500.0, 2000.0}) {
    const Motion motion = random.motion();
    Predictor predictor({});
    for (int i = 0; i <= 100; ++i) predictor.update(motion.at(i / rate));
    EXPECT_LT((predictor.velocity() - motion.v).norm(), 1e-5) << rate << " Hz";
    EXPECT_LT((predictor.angular_velocity() - motion.w).norm(), 1e-5) << rate << " Hz";
  }
}

/// Two targets a microsecond apart after engaging, 1 mm of noise between them: no 1000 m/s.
TEST(Predictor, CloseStampsMakeNoVelocity) {
  Random random(10);
  const Motion motion = random.motion();
  Predictor predictor({});
  for (int i = 0; i < 10; ++i) {
    Target target = motion.at(1e-6 * i);
    target.X_base_tool.p += random.vector(1e-3);
    predictor.update(target);
    EXPECT_EQ(predictor.velocity().norm(), 0.0);
  }
}

/// For any input the output is finite, within reach, and its rotations are valid.
TEST(Predictor, HoldsItsInvariants) {
  Random random(11);
  PredictorSettings settings;
  settings.reach = 0.9;
  Predictor predictor(settings);
  double t = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    t += random.uniform(0, 1) < 0.1 ? random.uniform(-0.5, 0.5) : random.uniform(0, 0.02);  // late, lost, set back
    Target target = random.motion().at(0.0);
    target.stamp.hand = from_seconds(t);
    target.engaged = random.uniform(0, 1) < 0.95;
    if (i % 100 == 0) target.X_base_tool.p.y() = std::nan("");
    if (i % 100 == 1) target.X_base_tool.q.coeffs().setZero();
    predictor.update(target);
    const Reference reference = predictor.predict(from_seconds(t + random.uniform(-0.1, 0.4)));
    for (int k = 0; k < reference.nodes; ++k) {
      ASSERT_LT(reference.tools[0].p[k].norm(), settings.reach + 1e-12);  // false for NaN
      ASSERT_LT((reference.tools[0].R[k] * reference.tools[0].R[k].transpose() - Matrix3::Identity()).norm(), 1e-12);
      ASSERT_GT(reference.tools[0].R[k].determinant(), 0.0);
    }
  }
}

TEST(Predictor, ALostHandRestsWhereItWasSeenLast) {
  Random random(12);
  const Motion motion = random.motion();
  Predictor predictor({});
  for (int i = 0; i <= 20; ++i) predictor.update(motion.at(0.01 * i));
  EXPECT_LT((predictor.predict(from_seconds(0.44)).tools[0].p[7] - motion.at(0.84).X_base_tool.p).norm(), 1e-6);
  const Reference lost = predictor.predict(from_seconds(0.46));
  for (int k = 0; k < 8; ++k) EXPECT_EQ(lost.tools[0].p[k], motion.at(0.2).X_base_tool.p);
}

TEST(Predictor, AClockThatWasSetBackStartsAnew) {
  Random random(13);
  const Motion motion = random.motion();
  Predictor predictor({});
  for (int i = 0; i < 20; ++i) predictor.update(motion.at(100 + 0.01 * i));
  predictor.update(motion.at(0.0));
  EXPECT_EQ(predictor.newest().stamp.hand, Time(0));
  EXPECT_EQ(predictor.velocity().norm(), 0.0);
}

TEST(Predictor, ClipsToTheReach) {
  Random random(4);
  PredictorSettings settings;
  settings.reach_center = {0.0, 0.0, 0.1625};
  settings.reach = 0.9;
  for (int trial = 0; trial < 2000; ++trial) {
    const Motion motion = random.motion();
    Predictor predictor(settings);
    for (int i = 0; i < 10; ++i) predictor.update(motion.at(0.011 * i));
    const Reference reference = predictor.predict(from_seconds(0.1));
    for (int k = 0; k < 8; ++k) {
      const Vector3 free = motion.at(0.1 + (k + 1) * 0.05).X_base_tool.p - settings.reach_center;
      const Vector3 clipped = reference.tools[0].p[k] - settings.reach_center;
      EXPECT_LE(clipped.norm(), settings.reach + 1e-12);
      EXPECT_LT((clipped - free * std::min(1.0, settings.reach / free.norm())).norm(), 1e-6);
    }
  }
}

TEST(Predictor, ReclutchingCreatesNoVelocity) {
  Random random(5);
  const Motion before = random.motion(), after = random.motion();
  Predictor predictor({});
  for (int i = 0; i < 20; ++i) predictor.update(before.at(0.011 * i));
  EXPECT_GT(predictor.velocity().norm(), 0.0);
  Target released = before.at(0.23);
  released.engaged = false;
  predictor.update(released);
  EXPECT_EQ(predictor.velocity().norm(), 0.0);
  EXPECT_EQ(predictor.angular_velocity().norm(), 0.0);
  predictor.update(after.at(0.24));
  EXPECT_EQ(predictor.velocity().norm(), 0.0);
}

TEST(Predictor, GapStartsAnew) {
  Random random(6);
  const Motion motion = random.motion();
  Predictor predictor({});
  for (int i = 0; i < 20; ++i) predictor.update(motion.at(0.011 * i));
  predictor.update(motion.at(1.0));
  EXPECT_EQ(predictor.velocity().norm(), 0.0);
}

TEST(Predictor, OldAndRepeatedStampsAreDropped) {
  Random random(7);
  const Motion motion = random.motion();
  Predictor predictor({}), same({});
  for (int i = 0; i < 20; ++i) {
    predictor.update(motion.at(0.011 * i));
    same.update(motion.at(0.011 * i));
    Target wrong = motion.at(0.011 * i - (i % 2 ? 0.0 : 0.005));
    wrong.X_base_tool.p += random.vector(1.0);
    same.update(wrong);
  }
  EXPECT_EQ(predictor.velocity(), same.velocity());
  EXPECT_EQ(predictor.newest().stamp.hand, same.newest().stamp.hand);
}

TEST(Predictor, NothingBeforeTheFirstTargetAndRestAfterIt) {
  Predictor predictor({});
  EXPECT_EQ(predictor.predict(Time(0)).nodes, 0);
  Random random(8);
  const Motion motion = random.motion();
  predictor.update(motion.at(0.0));
  const Reference reference = predictor.predict(from_seconds(1.0));
  for (int k = 0; k < 8; ++k) EXPECT_LT((reference.tools[0].p[k] - motion.p).norm(), 1e-12);
}

TEST(Predictor, PredictsNoFurtherThanAReferenceHolds) {
  Random random(9);
  for (const auto& [asked, given] : {std::pair(kMaxHorizon + 1000, kMaxHorizon), std::pair(-1, 0)}) {
    PredictorSettings settings;
    settings.horizon = asked;
    Predictor predictor(settings);
    predictor.update(random.motion().at(0.0));
    EXPECT_EQ(predictor.predict(from_seconds(0.1)).nodes, given);
  }
}

/// Reaches from rest to rest along minimum-jerk paths, as hands do, with what a network does to their stamps.
struct Reaches {
  std::vector<double> begin;
  std::vector<Pose> place;

  explicit Reaches(Random& random, int count = 12) {
    double t = 0.0;
    for (int i = 0; i < count; ++i) {
      begin.push_back(t);
      place.push_back({random.vector(0.4), rotation(random.vector(0.8))});
      t += random.uniform(0.7, 1.4);
    }
  }
  Pose at(double t) const {
    std::size_t i = 0;
    while (i + 2 < begin.size() && t >= begin[i + 1]) ++i;
    const double s = std::clamp((t - begin[i]) / 0.7, 0.0, 1.0);
    const double share = s * s * s * (10.0 + s * (6.0 * s - 15.0));
    const Vector3 turn = rotation_vector(place[i + 1].q * place[i].q.conjugate());
    return {place[i].p + share * (place[i + 1].p - place[i].p), rotation(share * turn) * place[i].q};
  }
};

struct Errors {
  double position = 0.0, angle = 0.0;
  int count = 0;
};

/// Over reaches at 90 Hz with noise, stalls of 80 ms and what comes in bursts behind them.
Errors errors_on_reaches(Prediction model, double ahead) {
  Random random(11);
  Errors sum;
  for (int trial = 0; trial < 30; ++trial) {
    const Reaches reaches(random);
    PredictorSettings settings;
    settings.model = model;
    Predictor predictor(settings);
    double t = 0.0;
    for (int i = 0; t < 8.0; ++i) {
      t += i % 40 == 39 ? 0.08 : random.uniform(0.008, 0.014);
      Target target;
      target.stamp = {from_seconds(t), from_seconds(t)};
      target.engaged = true;
      target.X_base_tool = reaches.at(t);
      target.X_base_tool.p += Vector3(random.normal(5e-4), random.normal(5e-4), random.normal(5e-4));
      predictor.update(target);
      const Pose guess = predictor.at(from_seconds(t + ahead)), truth = reaches.at(t + ahead);
      sum.position += (guess.p - truth.p).squaredNorm();
      sum.angle += std::pow(guess.q.angularDistance(truth.q), 2);
      ++sum.count;
    }
  }
  return sum;
}

TEST(DecayingPrediction, IsNearerThanConstantVelocityOnReaches) {
  for (const double ahead : {0.1, 0.2, 0.4}) {
    const Errors constant = errors_on_reaches(Prediction::kConstantVelocity, ahead);
    const Errors decaying = errors_on_reaches(Prediction::kDecaying, ahead);
    ASSERT_EQ(constant.count, decaying.count);
    EXPECT_LT(decaying.position, 0.8 * constant.position) << ahead;
    EXPECT_LT(decaying.angle, 0.8 * constant.angle) << ahead;
  }
}

/// It estimates the velocity of a moving hand, then lets it decay: far ahead the hand is at rest. The spread grows with
/// the time ahead and the speed. It is 0 for a lost hand and for constant velocity.
TEST(DecayingPrediction, KnowsHowFarOffItMayBe) {
  PredictorSettings settings;
  settings.model = Prediction::kDecaying;
  const Predictor fresh(settings);
  EXPECT_EQ(fresh.spread(Time(0)).along, 0.0);
  Predictor predictor(settings);
  const auto pass = [&](double speed) {
    predictor = Predictor(settings);
    Motion motion{Vector3::Zero(), Vector3(speed, 0.0, 0.0), Vector3::Zero(), Quaternion::Identity()};
    for (int i = 0; i < 60; ++i) predictor.update(motion.at(0.011 * i));
    return predictor.newest().stamp.hand;
  };
  const Time slow_end = pass(0.1);
  double before = 0.0;
  for (const double ahead : {0.0, 0.05, 0.1, 0.2, 0.4, 0.8}) {
    const Spread spread = predictor.spread(slow_end + from_seconds(ahead));
    EXPECT_GT(spread.along, before);
    EXPECT_GE(spread.along, spread.across);
    before = spread.along;
  }
  const Spread slow = predictor.spread(slow_end + from_seconds(0.2));
  const Spread fast = predictor.spread(pass(1.0) + from_seconds(0.2));
  EXPECT_GT(fast.along, 3.0 * slow.along);
  EXPECT_GT(fast.across, 1.5 * slow.across);
  const Reference reference = predictor.predict(predictor.newest().stamp.hand);
  EXPECT_EQ(reference.tools[0].spread[3].along, fast.along);
  EXPECT_EQ(predictor.predict(predictor.newest().stamp.hand + from_seconds(1.0)).tools[0].spread[0].along,
            0.0);  // lost
  predictor.set_model(Prediction::kConstantVelocity);
  EXPECT_EQ(predictor.predict(predictor.newest().stamp.hand).tools[0].spread[3].along, 0.0);
}

TEST(DecayingPrediction, ComesToRest) {
  Random random(12);
  for (int trial = 0; trial < 200; ++trial) {
    const Motion motion = random.motion();
    PredictorSettings settings;
    settings.model = Prediction::kDecaying;
    Predictor predictor(settings);
    double t = 0.0;
    for (int i = 0; i < 200; ++i) predictor.update(motion.at(t += random.uniform(0.008, 0.014)));
    EXPECT_LT((predictor.velocity() - motion.v).norm(), 0.01 + 0.01 * motion.v.norm());
    EXPECT_LT((predictor.angular_velocity() - motion.w).norm(), 0.01 + 0.01 * motion.w.norm());
    const Time now = from_seconds(t);
    EXPECT_LT((predictor.at(now).p - motion.at(t).X_base_tool.p).norm(), 1e-3);
    const Vector3 far = predictor.at(now + from_seconds(5.0)).p;
    EXPECT_LT((predictor.at(now + from_seconds(50.0)).p - far).norm(), 1e-3);
    EXPECT_LT((far - predictor.at(now).p - 0.4 * motion.v).norm(), 0.01 + 0.02 * motion.v.norm());
  }
}

/// After a gap, a disengagement or a clock that was set, what was before does not count.
TEST(DecayingPrediction, StartsAnewFromRest) {
  for (const int how : {0, 1, 2}) {
    Random random(13);
    const Motion motion = random.motion();
    PredictorSettings settings;
    settings.model = Prediction::kDecaying;
    Predictor predictor(settings);
    double t = 100.0;
    for (int i = 0; i < 50; ++i) predictor.update(motion.at(t += 0.011));
    Target next = motion.at(t + 0.011);
    if (how == 0) next = motion.at(t + 1.0);
    if (how == 1) next.engaged = false;
    if (how == 2) next = motion.at(t - 50.0);
    predictor.update(next);
    EXPECT_EQ(predictor.velocity(), Vector3::Zero()) << how;
    EXPECT_LT((predictor.at(next.stamp.hand + from_seconds(0.3)).p - next.X_base_tool.p).norm(), 1e-12) << how;
  }
}

}  // namespace
}  // namespace steadyhand
