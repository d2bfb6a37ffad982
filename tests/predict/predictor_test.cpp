#include "predict/predictor.hpp"

#include <gtest/gtest.h>

#include <random>

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
      EXPECT_LT((reference.p[k] - expected.X_base_tool.p).norm(), 1e-6);
      EXPECT_LT((reference.R[k] - expected.X_base_tool.q.toRotationMatrix()).norm(), 1e-5);
    }
  }
}

/// Noise of 1 mm and 0.5 degrees: no bias, and the spread that the least-squares slope of evenly spread samples has.
TEST(Predictor, NoiseIsAveraged) {
  Random random(3);
  const double sigma = 1e-3;
  const int samples = 8;  // in 0.08 s at 90 Hz
  const double spacing = 1.0 / 90.0,
               expected = sigma * std::sqrt(12.0 / (samples * (samples * samples - 1.0))) / spacing;
  double sum = 0.0, squares = 0.0;
  const int trials = 4000;
  for (int trial = 0; trial < trials; ++trial) {
    const Motion motion = random.motion();
    Predictor predictor({});
    for (int i = 0; i < 20; ++i) {
      Target target = motion.at(i * spacing);
      for (int c = 0; c < 3; ++c) target.X_base_tool.p[c] += random.normal(sigma);
      predictor.update(target);
    }
    const double error = predictor.velocity().x() - motion.v.x();
    sum += error;
    squares += error * error;
  }
  EXPECT_LT(std::abs(sum / trials), 4.0 * expected / std::sqrt(trials));
  EXPECT_NEAR(std::sqrt(squares / trials), expected, 0.1 * expected);
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
      const Vector3 clipped = reference.p[k] - settings.reach_center;
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
  for (int k = 0; k < 8; ++k) EXPECT_LT((reference.p[k] - motion.p).norm(), 1e-12);
}

}  // namespace
}  // namespace steadyhand
