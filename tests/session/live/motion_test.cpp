// The motion as operators feel it: repeated engaging, the edge of the reach, the arm's own body, singularities.
#include <fmt/format.h>

#include <random>

#include "geometry/robot/random_arm.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

/// Largest changes from one command to the next.
struct Steps {
  double q = 0.0, dq = 0.0;
  JointCommand last;
  void add(const JointCommand& c) {
    if (last.q.size() > 0) {
      q = std::max(q, (c.q - last.q).cwiseAbs().maxCoeff());
      dq = std::max(dq, (c.dq - last.dq).cwiseAbs().maxCoeff());
    }
    last = c;
  }
};

/// Engages a hundred times, often before the arm has stopped; the hand moves elsewhere in between if `anywhere`.
Steps grip_a_hundred_times(bool anywhere, std::vector<JointVector>& commands) {
  VirtualSession session;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Pose offset;
  const auto sweep = sweeping({0.1, 0.15, 0.1}, 3.0);
  session.hand = [&](double t) {
    const Pose pose = sweep(t);
    return Pose{pose.p + offset.p, pose.q * offset.q};
  };
  Steps steps;
  session.on_command = [&](const JointCommand& c) {
    steps.add(c);
    commands.push_back(c.q);
  };
  session.run(0.2);
  for (int i = 0; i < 100; ++i) {
    session.clutch = false;
    session.run(0.1 + 0.1 * unit(random));
    const Vector3 p = random_vector(random), axis = random_vector(random);
    if (anywhere) offset = {p, Quaternion(Eigen::AngleAxisd(M_PI * unit(random), axis.normalized()))};
    if (!anywhere) (void)unit(random);
    EXPECT_TRUE(session.grip()) << i << ": " << session.view.reason;
    session.run(0.3);
  }
  session.expect_safe();
  return steps;
}

TEST(Motion, FirstMovesAreSlowUntilAGripAfterThem) {
  VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
  options.first_speed_scaling = 0.25;
  options.first_moves = 1.0;
  VirtualSession session(options);
  session.hand = sweeping({0.3, 0.3, 0.2}, 4.0);
  double speed = 0.0, acceleration = 0.0;  // shares of the limits
  session.on_command = [&](const JointCommand& c) {
    speed = std::max(speed, (c.dq.cwiseAbs().array() / ur5e().velocity_max.array()).maxCoeff());
    acceleration = std::max(acceleration, (c.ddq.cwiseAbs().array() / ur5e().acceleration_max.array()).maxCoeff());
  };
  session.run(0.2);
  for (int grips = 0; grips < 2; ++grips) {  // the second comes before first_moves have passed
    ASSERT_TRUE(session.grip()) << session.view.reason;
    session.run(grips == 0 ? 0.4 : 1.5);  // the end of first_moves changes nothing before the next grip
    session.clutch = false;
    ASSERT_TRUE(session.run_until([&] { return session.at_rest(); }, 2.0));
    EXPECT_LT(speed, 0.25 + 1e-4);
    EXPECT_LT(acceleration, 0.25 + 1e-4);
  }
  EXPECT_GT(speed, 0.2);
  EXPECT_GT(acceleration, 0.2);
  speed = acceleration = 0.0;
  ASSERT_TRUE(session.grip()) << session.view.reason;
  session.run(1.5);
  EXPECT_GT(speed, 0.5);
  EXPECT_GT(acceleration, 0.5);
  session.expect_safe();
}

TEST(Motion, WhereTheHandIsAtAHundredGripsMakesNoDifference) {
  std::vector<JointVector> here, there;
  const Steps ordinary = grip_a_hundred_times(false, here), anywhere = grip_a_hundred_times(true, there);
  ASSERT_EQ(here.size(), there.size());
  double apart = 0.0;
  for (std::size_t i = 0; i < here.size(); ++i) apart = std::max(apart, (here[i] - there[i]).cwiseAbs().maxCoeff());
  EXPECT_LT(apart, 1e-3);
  EXPECT_LE(anywhere.q, 1.01 * ordinary.q);
  EXPECT_LE(anywhere.dq, 1.01 * ordinary.dq);
}

/// A hand that goes out by `away` in 2 s, wanders across there for 5 s, and comes back in 2 s.
std::function<Pose(double)> push(double begin, const Vector3& away, const Vector3& across) {
  return [=](double time) {
    const double t = time - begin;
    const auto smooth = [](double x) { return x <= 0.0 ? 0.0 : x >= 1.0 ? 1.0 : x * x * (3.0 - 2.0 * x); };
    const double out = smooth(t / 2.0) * (1.0 - smooth((t - 7.0) / 2.0));
    Pose pose;
    pose.p = out * away + out * std::sin(2.0 * (t - 2.0)) * across;
    return pose;
  };
}

/// m/s: the hand itself comes back with up to 0.7 m/s, and the glass has to catch up with it.
constexpr double kCalm = 1.3;

struct PushResult {
  double longest_freeze = 0.0;  ///< s, the glass below 1 mm/s while the hand wandered faster than 0.1 m/s
  double fastest = 0.0;         ///< m/s, of the glass, on the way back
};

PushResult push_and_return(VirtualSession& session, const Vector3& away, const Vector3& across) {
  session.run(0.2);
  EXPECT_TRUE(session.grip());
  session.run(0.6);
  const double begin = session.now();
  session.hand = push(begin, away, across);
  PushResult result;
  Vector3 last = session.glass(session.last_command.q).p;
  double frozen = 0.0;
  session.on_command = [&](const JointCommand& c) {
    const Vector3 p = session.glass(c.q).p;
    const double speed = (p - last).norm() / 0.002, t = session.now() - begin;
    last = p;
    const bool wanders = t > 2.5 && t < 6.8 && across.norm() * 2.0 * std::abs(std::cos(2.0 * (t - 2.0))) > 0.1;
    frozen = wanders && speed < 1e-3 ? frozen + 0.002 : 0.0;
    result.longest_freeze = std::max(result.longest_freeze, frozen);
    if (t > 7.0) result.fastest = std::max(result.fastest, speed);
  };
  session.run(10.0);
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  session.expect_safe();
  testing::Test::RecordProperty("longest_freeze_ms", fmt::format("{}", 1e3 * result.longest_freeze));
  testing::Test::RecordProperty("fastest_m_s", fmt::format("{}", result.fastest));
  return result;
}

/// At planning rates from slow to every control cycle, Hz.
struct Pushed : testing::TestWithParam<double> {
  VirtualSession session{VirtualSession::Options::at_rate(GetParam())};
};
INSTANTIATE_TEST_SUITE_P(, Pushed, testing::Values(50.0, 250.0),
                         [](const auto& param) { return fmt::format("At{}Hz", param.param); });

TEST_P(Pushed, BeyondTheReachItMovesAlongTheEdgeAndComesBackCalmly) {
  const PushResult result = push_and_return(session, {0.9, 0.0, 0.0}, {0.0, 0.2, 0.1});
  EXPECT_LE(result.longest_freeze, 2.0 / GetParam());
  EXPECT_LE(result.fastest, kCalm);
}

TEST_P(Pushed, IntoItselfItMovesAlongAndComesBackCalmly) {
  const PushResult result = push_and_return(session, {-0.5, 0.0, -0.1}, {0.0, 0.2, 0.05});
  EXPECT_LE(result.longest_freeze, 2.0 / GetParam());
  EXPECT_LE(result.fastest, kCalm);
  EXPECT_LT(session.monitor().result().smallest_clearance, 0.01);  // it was pushed there
}

constexpr double kKept = 0.01;  // m, around an obstacle

Obstacles only(const Shape& shape, const Vector3& p, const Vector3& up = Vector3::UnitZ()) {
  Obstacles obstacles;
  obstacles.list[obstacles.count++] = {shape.inflated(kKept),
                                       {p, Quaternion::FromTwoVectors(Vector3::UnitZ(), up).toRotationMatrix()},
                                       Vector3::Zero(),
                                       kKept,
                                       {}};
  return obstacles;
}

TEST_P(Pushed, IntoTableWallAndBoxItSlidesAlongAndComesOffCalmly) {
  const struct {
    const char* name;
    Obstacles obstacles;
    Vector3 away, across;
  } pushes[] = {
      {"table", only(Shape::box({0.4, 0.8, 0.1}), {0.75, 0.0, 0.12}), {0.0, 0.0, -0.35}, {0.08, 0.2, 0.0}},
      {"wall", only(Shape::half_space(), {0.75, 0.0, 0.0}, -Vector3::UnitX()), {0.35, 0.0, 0.0}, {0.0, 0.2, 0.1}},
      {"box", only(Shape::box({0.3, 0.05, 0.3}), {0.55, -0.35, 0.4}), {0.0, -0.4, 0.0}, {0.1, 0.0, 0.1}}};
  for (const auto& [name, obstacles, away, across] : pushes) {
    SCOPED_TRACE(name);
    VirtualSession pushed(VirtualSession::Options::at_rate(GetParam()));
    pushed.set_obstacles(obstacles);
    const PushResult result = push_and_return(pushed, away, across);
    EXPECT_LE(result.longest_freeze, 2.0 / GetParam());
    EXPECT_LE(result.fastest, kCalm);
    EXPECT_GT(pushed.monitor().result().smallest_distance, kKept - 2e-5);
    EXPECT_LT(pushed.monitor().result().smallest_distance, kKept + 0.003) << "it was pushed there";
    EXPECT_LE(pushed.planner_view.failed, pushed.planner_view.solves / 1000);
  }
}

/// A long body along a wall, a flat one on a table: no corner is the nearest for long, yet the plans stay calm.
TEST(Motion, ALongAndAFlatBodyLieAlongAWallAndATable) {
  constexpr double kRate = 50.0;  // Hz
  const struct {
    const char* name;
    Shape glass;
    Obstacles obstacles;
    Vector3 away, across;
  } pushes[] = {{"capsule, wall",
                 Shape::capsule(0.08, 0.05),
                 only(Shape::half_space(), {0.75, 0.0, 0.0}, -Vector3::UnitX()),
                 {0.35, 0.0, 0.0},
                 {0.0, 0.2, 0.1}},
                {"capsule, box",
                 Shape::capsule(0.08, 0.05),
                 only(Shape::box({0.05, 0.6, 0.6}), {0.8, 0.0, 0.4}),
                 {0.35, 0.0, 0.0},
                 {0.0, 0.2, 0.1}},
                {"box, table",
                 Shape::box({0.06, 0.06, 0.06}, 0.01),
                 only(Shape::half_space(), {0.0, 0.0, 0.22}),
                 {0.0, 0.0, -0.35},
                 {0.08, 0.2, 0.0}}};
  for (const auto& [name, glass, obstacles, away, across] : pushes) {
    SCOPED_TRACE(name);
    RobotModel model = ur5e();
    Obstacles there = obstacles;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
      Body& body = model.bodies[i];
      if (body.name == "glass_bottom") {
        body.shape = glass;
        body.origin = model.tool().origin;
      } else {
        there.list[0].ignores.set(i);  // its turn has come in other tests
      }
    }
    VirtualSession::Options options = VirtualSession::Options::at_rate(kRate);
    options.model = &model;
    VirtualSession pushed(options);
    pushed.set_obstacles(there);
    const PushResult result = push_and_return(pushed, away, across);
    EXPECT_LE(result.longest_freeze, 2.0 / kRate);
    EXPECT_LE(result.fastest, kCalm);
    EXPECT_GT(pushed.monitor().result().smallest_distance, kKept - 2e-5);
    EXPECT_LT(pushed.monitor().result().smallest_distance, kKept + 0.003) << "it was pushed there";
    EXPECT_LE(pushed.planner_view.failed, pushed.planner_view.solves / 1000);
  }
}

/// Joints that may hardly move: the arm goes to their limits, and to the last digit no further.
TEST(Motion, ALimitOfPositionIsKeptToTheLastDigit) {
  RobotModel model = ur5e();
  model.position_min = model.home.array() - 0.25;
  model.position_max = model.home.array() + 0.25;
  VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
  options.model = &model;
  VirtualSession session(options);
  session.hand = sweeping({0.4, 0.5, 0.3}, 2.0);
  double farthest = 0.0;
  session.on_command = [&](const JointCommand& c) {
    farthest = std::max(farthest, (c.q - model.home).cwiseAbs().maxCoeff());
  };
  session.run(0.2);
  ASSERT_TRUE(session.grip());
  session.run(10.0);
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  EXPECT_GT(farthest, 0.245);  // at its nodes a plan stays 4.7 mrad inside, for what is between
  EXPECT_LE(farthest, 0.25);
  session.expect_safe();
}

/// Hands that move through the singularities of wrist, elbow and shoulder.
TEST(Motion, SingularitiesStopNothing) {
  struct Path {
    const char* name;
    Vector3 away, across;
    double turn;
  };
  for (const Path& path :
       {Path{"wrist", {0.0, 0.0, 0.1}, {0.0, 0.1, 0.0}, 1.9}, Path{"elbow", {0.5, 0.0, 0.1}, {0.0, 0.1, 0.1}, 0.0},
        Path{"shoulder", {-0.55, 0.0, 0.4}, {0.1, 0.15, 0.0}, 0.0}}) {
    VirtualSession session;
    session.run(0.2);
    ASSERT_TRUE(session.grip());
    const double begin = session.now();
    const auto base = push(begin, path.away, path.across);
    session.hand = [&](double t) {
      Pose pose = base(t);
      pose.q = Eigen::AngleAxisd(path.turn * std::sin(0.5 * (t - begin)), Vector3::UnitZ());
      return pose;
    };
    for (int i = 0; i < 5000; ++i) {
      session.cycle();
      ASSERT_EQ(session.state(), SupervisionState::kEngaged) << path.name << ": " << session.view.reason;
    }
    EXPECT_EQ(session.planner_view.failed, 0u) << path.name;
    session.expect_safe();
  }
}

/// As the requests `weight` leave it, one term after another.
TEST(Weights, OfNothingLeaveTheArmAtRestWithTheHand) {
  VirtualSession session;
  session.run(0.2);
  ASSERT_TRUE(session.grip());
  OperatorSettings settings;
  settings.scale = 1.0;
  settings.objectives = static_cast<int>(session.planning().ocp().objectives().size());
  for (int i = 0; i < settings.objectives; ++i) {
    settings.weights[i] =
        JointVector::Zero(session.planning().ocp().objectives()[i]->weight_count(session.planning().ocp().model()));
  }
  const JointVector q = session.last_command.q;
  for (int counts = -1; counts < settings.objectives; ++counts) {
    OperatorSettings one = settings;
    if (counts >= 0) one.weights[counts].setConstant(1.0);
    session.set(one);
    session.run(1.5);
    EXPECT_EQ(session.state(), SupervisionState::kEngaged);
    EXPECT_LT((session.last_command.q - q).cwiseAbs().maxCoeff(), 0.01) << "rad, with weight " << counts << " alone";
  }
  session.expect_safe();
}

}  // namespace
}  // namespace steadyhand
