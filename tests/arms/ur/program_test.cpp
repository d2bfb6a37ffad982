// The program that runs on the controller, away from any network: a host of registers and a clock of cycles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "steadyhand/arms/ur/ur_program.hpp"
#include "support/ur/urscript.hpp"

namespace steadyhand {
namespace {

using namespace urscript;
using R = UrRegisters;

/// Registers, and an arm that is where servoj last wanted it.
class ProgramHost {
 public:
  explicit ProgramHost(const UrProgramSettings& settings) {
    builtins_["get_steptime"] = [](const Arguments&, Waiting&) { return Value(0.002); };
    builtins_["get_target_joint_positions"] = [this](const Arguments&, Waiting&) { return Value(List(6, Value(q))); };
    builtins_["get_target_joint_speeds"] = [this](const Arguments&, Waiting&) { return Value(List(6, Value(dq))); };
    builtins_["textmsg"] = [](const Arguments&, Waiting&) { return Value(); };
    builtins_["norm"] = [](const Arguments& a, Waiting&) {
      if (!std::holds_alternative<List>(a.values[0])) return Value(std::abs(number(a.values[0])));
      double sum = 0.0;
      for (const Value& each : list(a.values[0])) sum += number(each) * number(each);
      return Value(std::sqrt(sum));
    };
    builtins_["read_input_float_register"] = [this](const Arguments& a, Waiting&) {
      return Value(doubles.at(static_cast<std::size_t>(number(a.values[0]))));
    };
    builtins_["read_input_integer_register"] = [this](const Arguments& a, Waiting&) {
      return Value(double(integers.at(static_cast<std::size_t>(number(a.values[0])))));
    };
    builtins_["write_output_integer_register"] = [this](const Arguments& a, Waiting&) {
      outputs.at(static_cast<std::size_t>(number(a.values[0]))) = static_cast<int>(number(a.values[1]));
      return Value();
    };
    builtins_["sync"] = [](const Arguments&, Waiting& thread) {
      thread.next_cycle();
      return Value();
    };
    builtins_["servoj"] = [this](const Arguments& a, Waiting& thread) {
      const double next = number(list(a.values[0])[2]);
      for (const Value& each : list(a.values[0])) EXPECT_EQ(number(each), next);
      const double before = dq;
      dq = (next - q) / 0.002;
      hardest = std::max(hardest, std::abs(dq - before) / 0.002);
      q = next;
      thread.next_cycle();
      return Value();
    };
    builtins_["stopj"] = [this](const Arguments& a, Waiting&) {
      EXPECT_GT(number(a.values[0]), 1.0);
      stopped = true;
      return Value();
    };
    program_ = std::make_unique<Program>(make_ur_program(settings), builtins_);
  }
  bool cycle() { return program_->cycle(); }
  std::string error() const { return program_->error(); }
  int effort() const { return program_->effort(); }
  UrProgramState state() const { return static_cast<UrProgramState>(outputs[R::kState]); }
  /// A set-point for all joints alike, that answers to the program's newest cycle.
  void set_point(double p, double v, double a, int session = 1) {
    for (int i = 0; i < 6; ++i) {
      doubles[R::kQ + i] = p;
      doubles[R::kDq + i] = v;
      doubles[R::kDdq + i] = a;
    }
    integers[R::kAnswers] = outputs[R::kCycle];
    integers[R::kMode] = 1;
    integers[R::kSession] = session;
  }

  std::array<double, 48> doubles{};
  std::array<int, 48> integers{}, outputs{};
  double q = 0.5, dq = 0.0, hardest = 0.0;
  bool stopped = false;

 private:
  Builtins builtins_;
  std::unique_ptr<Program> program_;
};

UrProgramSettings settings() {
  UrProgramSettings s;
  s.velocity_max = JointVector::Constant(6, 3.0);
  s.acceleration_max = JointVector::Constant(6, 7.0);
  return s;
}

/// The command at cycle k: stationary for a moment, then a swing.
struct Swing {
  double q, dq, ddq;
};
Swing swing(int k) {
  const double t = std::max(0, k - 50) * 0.002;
  return {0.5 + 0.3 * (1.0 - std::cos(2.0 * t)), 0.6 * std::sin(2.0 * t), 1.2 * std::cos(2.0 * t)};
}

TEST(UrProgram, FollowsWhatItIsTold) {
  ProgramHost host(settings());
  for (int k = 0; k < 1300; ++k) {
    ASSERT_TRUE(host.cycle()) << host.error();
    ASSERT_NEAR(host.q, k > 60 ? swing(k - 1).q : host.q, 1e-9);
    const Swing s = swing(k);
    host.set_point(s.q, s.dq, s.ddq);
  }
  EXPECT_EQ(host.state(), UrProgramState::kFollowing);
  EXPECT_LT(host.hardest, 1.3);
}

TEST(UrProgram, CarriesOnOverLostCycles) {
  ProgramHost host(settings());
  for (int k = 0; k < 1300; ++k) {
    ASSERT_TRUE(host.cycle()) << host.error();
    ASSERT_NEAR(host.q, k > 60 ? swing(k - 1).q : host.q, 1e-6) << k;
    const Swing s = swing(k);
    if (k < 100 || k % 5 < 3) host.set_point(s.q, s.dq, s.ddq);  // two of five are lost
  }
  EXPECT_EQ(host.state(), UrProgramState::kFollowing);
  EXPECT_LT(host.hardest, 2.0);
}

TEST(UrProgram, SlowsDownInAGapAndReturnsWithoutAStep) {
  ProgramHost host(settings());
  double furthest = 0.0;
  for (int k = 0; k < 1300; ++k) {
    ASSERT_TRUE(host.cycle()) << host.error() << " " << k;
    const Swing s = swing(k);
    if (k < 200 || k % 300 >= 10 || k > 1000) host.set_point(s.q, s.dq, s.ddq);  // 20 ms
    if (k > 200) furthest = std::max(furthest, std::abs(host.q - swing(k - 1).q));
  }
  EXPECT_EQ(host.state(), UrProgramState::kFollowing);
  EXPECT_GT(furthest, 1e-4);  // it did leave the path
  EXPECT_LT(furthest, 0.01);
  EXPECT_LT(host.hardest, 10.5);
  EXPECT_NEAR(host.q, swing(1298).q, 1e-4);
}

/// As hard as plans may: 0.2 s each way at 15 rad/s^2, back and forth.
Swing hard_swing(int k) {
  const double t = std::max(0, k - 50) * 0.002, u = std::fmod(t, 0.8);
  const double a = u < 0.2 || u >= 0.6 ? 15.0 : -15.0;
  const double v = u < 0.2 ? 15.0 * u : u < 0.6 ? 15.0 * (0.4 - u) : 15.0 * (u - 0.8);
  const double q = u < 0.2 ? 7.5 * u * u : u < 0.6 ? 0.6 - 7.5 * (0.4 - u) * (0.4 - u) : 7.5 * (0.8 - u) * (0.8 - u);
  return {0.5 + q, v, a};
}

/// From rest back and forth at 0.45 rad/s, with turns at 15 rad/s^2.
Swing turn(int k) {
  if (k < 50) return {0.5, 0.0, 0.0};
  const double u = std::fmod((k - 50) * 0.002 + 0.43, 0.92), start = 0.5 - 0.18675;
  const auto part = [&](double q, double v, double a, double t) -> Swing {
    return {start + q + v * t + 0.5 * a * t * t, v + a * t, a};
  };
  if (u < 0.4) return part(0.0, 0.45, 0.0, u);
  if (u < 0.46) return part(0.18, 0.45, -15.0, u - 0.4);
  if (u < 0.86) return part(0.18, -0.45, 0.0, u - 0.46);
  return part(0.0, -0.45, 15.0, u - 0.86);
}

UrProgramSettings fast_settings() {
  UrProgramSettings fast = settings();
  fast.acceleration_max = JointVector::Constant(6, 15.0);
  return fast;
}

/// Missed cycles are bridged with an acceleration that a plan may no longer have.
TEST(UrProgram, DoesNotStepWhereTheAccelerationJumpedInLostCycles) {
  for (const int apart : {2, 3, 4}) {
    UrProgramSettings fast = fast_settings();
    if (apart == 4) fast.state_period = 0.008;  // RTDE 1
    ProgramHost host(fast);
    double late = 0.0;
    for (int k = 0; k < 1300; ++k) {
      ASSERT_TRUE(host.cycle()) << host.error() << " " << k;
      const Swing s = turn(k);
      if (k < 20 || k % apart == 1) host.set_point(s.q, s.dq, s.ddq);
      if (k > 60) late = std::max(late, std::abs(host.q - turn(k - 1).q));
    }
    EXPECT_EQ(host.state(), UrProgramState::kFollowing);
    EXPECT_LT(late, 5e-3);
    EXPECT_LT(host.hardest, 1.3 * 15.0 + 0.5) << apart;
  }
}

/// Plans may accelerate harder than the arm brakes in a gap: on its way back it must be able to keep up with them.
TEST(UrProgram, ReturnsToSetPointsThatAccelerateAsPlansMay) {
  ProgramHost host(fast_settings());
  double late = 0.0;
  for (int k = 0; k < 1300; ++k) {
    ASSERT_TRUE(host.cycle()) << host.error() << " " << k;
    const Swing s = hard_swing(k);
    if (k < 200 || k % 300 >= 8) host.set_point(s.q, s.dq, s.ddq);
    if (k > 200 && k % 300 > 150) late = std::max(late, std::abs(host.q - hard_swing(k - 1).q));
  }
  EXPECT_EQ(host.state(), UrProgramState::kFollowing);
  EXPECT_LT(late, 1e-3);
  EXPECT_LT(host.hardest, 1.3 * 15.0 + 0.5);
}

/// RTDE 1 sends each fourth cycle of a 500 Hz controller; a command then holds until the next.
TEST(UrProgram, SetPointsForEachFourthCycleAreNotLostOnes) {
  UrProgramSettings old = settings();
  old.state_period = 0.008;
  ProgramHost host(old);
  for (int k = 0; k < 1300; ++k) {
    ASSERT_TRUE(host.cycle()) << host.error();
    // Where the swing begins its acceleration jumps between two states: that is caught up with first.
    ASSERT_NEAR(host.q, k > 400 ? swing(k - 1).q : host.q, 1e-6) << k;
    if (k == 100) host.hardest = 0.0;  // until it swings, what is said of its acceleration is not true
    const Swing s = swing(k);
    if (k % 4 == 0) host.set_point(s.q, s.dq, s.ddq);
  }
  EXPECT_EQ(host.state(), UrProgramState::kFollowing);
  EXPECT_LT(host.hardest, 2.0);
}

TEST(UrProgram, EndsAtRestWhenSetPointsStopComing) {
  ProgramHost host(settings());
  int k = 0;
  for (; k < 400; ++k) {
    ASSERT_TRUE(host.cycle());
    const Swing s = swing(k);
    host.set_point(s.q, s.dq, s.ddq);
  }
  int after = 0;
  while (host.cycle()) ASSERT_LT(++after, 40);
  EXPECT_GE(after, 25);  // 50 ms
  EXPECT_EQ(host.state(), UrProgramState::kSilence);
  EXPECT_TRUE(host.stopped);
  EXPECT_LT(host.hardest, 10.5);
}

TEST(UrProgram, WaitsForTheFirstSetPointButNotForEver) {
  ProgramHost host(settings());
  ASSERT_TRUE(host.cycle());
  EXPECT_EQ(host.state(), UrProgramState::kReady);
  int k = 1;
  while (host.cycle()) ASSERT_LT(++k, 1100);
  EXPECT_GT(k, 990);
  EXPECT_EQ(host.q, 0.5);
  EXPECT_EQ(host.state(), UrProgramState::kSilence);
}

/// The controller's interpreter has a share of the cycle. Its speed is undocumented, so the program does little in a
/// cycle.
TEST(UrProgram, EvaluatesLittleInACycle) {
  ProgramHost host(settings());
  int usual = 0, most = 0;
  for (int k = 0; k < 1300; ++k) {
    ASSERT_TRUE(host.cycle()) << host.error();
    most = std::max(most, host.effort());
    if (k > 300 && k < 600) usual = std::max(usual, host.effort());
    const Swing s = swing(k);
    if (k < 600 || k % 100 > 5) host.set_point(s.q, s.dq, s.ddq);
  }
  EXPECT_LT(usual, 230);
  EXPECT_LT(most, 480);
}

/// Between two cycles the arm was stationary, changed its speed, or moved elsewhere: an operator paused the program and
/// resumed it.
TEST(UrProgram, EndsWhenTheArmStoppedOrMovedWithoutIt) {
  struct Case {
    const char* name;
    double before, after, moved;  // rad/s, rad/s, rad
  };
  for (const Case& c :
       {Case{"fast, stopped", 0.6, 0.0, 0.0}, Case{"slow, stopped", 0.04, 0.0, 0.0}, Case{"slowed down", 0.6, 0.3, 0.0},
        Case{"stood, was pushed", 0.0, 0.0, 0.05}, Case{"fast, stopped further on", 0.6, 0.0, 0.3}}) {
    ProgramHost host(settings());
    // To that speed at 1 rad/s^2, and on.
    const auto command = [&](int k) {
      const double t = std::max(0, k - 50) * 0.002, ramp = c.before, u = std::min(t, ramp);
      return Swing{0.5 + 0.5 * u * u + c.before * (t - u), u, t < ramp ? 1.0 : 0.0};
    };
    for (int k = 0; k < 500; ++k) {
      ASSERT_TRUE(host.cycle()) << c.name << host.error();
      const Swing s = command(k);
      host.set_point(s.q, s.dq, s.ddq);
    }
    ASSERT_NEAR(host.dq, c.before, 1e-6);
    host.dq = c.after;
    host.q += c.moved;
    const double stood = host.q;
    for (int left = 0; host.cycle(); ++left) ASSERT_LT(left, 3) << c.name;
    EXPECT_EQ(host.state(), UrProgramState::kMoved) << c.name;
    EXPECT_EQ(host.q, stood) << c.name;
    EXPECT_TRUE(host.stopped);
  }
}

/// Inner lines are indented, as the script manual wants, and none is empty.
TEST(UrProgram, IsWrittenAsTheManualWantsIt) {
  const std::string text = make_ur_program(settings());
  std::istringstream lines(text);
  int number = 0;
  const auto count = std::count(text.begin(), text.end(), '\n');
  for (std::string line; std::getline(lines, line);) {
    const bool outer = ++number == 1 || number == count;
    EXPECT_EQ(outer, line.rfind("  ", 0) != 0) << number << ": " << line;
    EXPECT_NE(line.find_first_not_of(' '), std::string::npos) << number;
  }
}

/// Each case ends the program, and the arm does not jump.
TEST(UrProgram, RefusesWhatItMustNotFollow) {
  struct Case {
    const char* name;
    double first, later, dq;
    UrProgramState end;
  };
  for (const Case& c : {Case{"begins elsewhere", 0.53, 0.53, 0.0, UrProgramState::kTooFar},
                        Case{"steps", 0.5, 0.51, 0.0, UrProgramState::kTooFast},
                        Case{"is not a number", 0.5, std::nan(""), 0.0, UrProgramState::kTooFast}}) {
    ProgramHost host(settings());
    for (int k = 0; host.cycle(); ++k) {
      ASSERT_LT(k, 200) << c.name;
      host.set_point(k < 100 ? c.first : c.later, c.dq, 0.0);
    }
    EXPECT_TRUE(host.error().empty()) << c.name << host.error();
    EXPECT_NEAR(host.q, 0.5, 1e-3) << c.name;
    EXPECT_EQ(host.state(), c.end) << c.name;
  }
}

TEST(UrProgram, ObeysOnlyItsOwnSession) {
  ProgramHost host(settings());
  for (int k = 0; k < 500; ++k) {
    ASSERT_TRUE(host.cycle());
    host.set_point(0.6, 0.0, 0.0, 2);
  }
  EXPECT_EQ(host.state(), UrProgramState::kReady);
  EXPECT_EQ(host.q, 0.5);
}

TEST(UrProgram, StopsWhenItIsTold) {
  ProgramHost host(settings());
  for (int k = 0; k < 300; ++k) {
    ASSERT_TRUE(host.cycle());
    const Swing s = swing(k);
    host.set_point(s.q, s.dq, s.ddq);
  }
  host.integers[R::kMode] = 0;
  EXPECT_FALSE(host.cycle() && host.cycle());
  EXPECT_EQ(host.state(), UrProgramState::kAsked);
  EXPECT_TRUE(host.stopped);
}

TEST(UrScript, BadProgramsAreErrorsAndNothingWorse) {
  Builtins none;
  for (const char* source :
       {"", "x = 1\n", "def f(:\nend\n", "def f():\n", "def f():\n  if True:\nend\n", "def f():\n  1 = 2\nend\n",
        "def f():\n  x = \"\nend\n", "def f():\n  x = [1, 2\nend\n", "end\n", "def f():\n  x = ((((1\nend\n"}) {
    EXPECT_THROW(Program(source, none), ScriptError) << source;
  }
  for (const char* source :
       {"def f():\n  x = y\nend\n", "def f():\n  x = 1 / 0\nend\n", "def f():\n  while True:\n  end\nend\n",
        "def f():\n  f()\nend\n", "def f():\n  x = [1]\n  x[1] = 2\nend\n", "def f():\n  jump()\nend\n",
        "def f():\n  if 1:\n  end\nend\n", "def f():\n  x = run g()\nend\n", "def f():\n  x = [1] + [1, 2]\nend\n"}) {
    Program program(source, none);
    EXPECT_FALSE(program.cycle()) << source;
    EXPECT_FALSE(program.error().empty()) << source;
  }
  std::string deep = "def f():\n  x = ";
  for (int i = 0; i < 100000; ++i) deep += "(";
  EXPECT_THROW(Program(deep, none), ScriptError);
}

}  // namespace
}  // namespace steadyhand
