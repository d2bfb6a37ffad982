// Two hands move two arms. Each test is a row of docs/reference/safety.md, or says what one arm does meanwhile.
#include <fmt/format.h>

#include <cstdlib>
#include <map>
#include <random>
#include <string>

#include "support/temporary_folder.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using State = SupervisionState;

const RobotModel& robot(const std::string& name) {
  static std::map<std::string, RobotModel> models;
  if (!models.contains(name)) {
    const Result<RobotModel> model = open_robot(name);
    EXPECT_TRUE(model) << model.error().message;
    models.emplace(name, *model);
  }
  return models.at(name);
}

/// Both hands move, with open clutches.
struct TwoHands {
  explicit TwoHands(const std::string& name = "two_ur5e", const std::string& profile = "tracking", bool together = true)
      : model(robot(name)), session(options(model, profile, together)) {
    session.hand = sweeping({0.10, 0.12, 0.08});
    session.second_hand = sweeping({0.08, 0.10, 0.10}, 2.5);
    session.run(0.3);
    EXPECT_EQ(session.state(), State::kReady);
  }
  ~TwoHands() { session.expect_safe(); }

  static VirtualSession::Options options(const RobotModel& model, const std::string& profile, bool together) {
    VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
    options.model = &model;
    options.profile = profile;
    options.together = together;
    return options;
  }
  /// Both tools follow for a while.
  void lead_both(double seconds = 1.5) {
    ASSERT_TRUE(session.grip(0)) << session.view.reason;
    ASSERT_TRUE(session.grip(1)) << session.view.reason;
    session.run(seconds);
    ASSERT_EQ(state(0), State::kEngaged) << session.view.hands[0].reason;
    ASSERT_EQ(state(1), State::kEngaged) << session.view.hands[1].reason;
  }
  State state(int tool) const { return session.view.hands[tool].state; }
  /// Joints that move this tool and not the other.
  std::vector<int> own(int tool) const {
    std::vector<int> joints;
    const std::vector<int> mine = model.chain(model.tools[tool].link), others = model.chain(model.tools[1 - tool].link);
    std::ranges::set_difference(mine, others, std::back_inserter(joints));
    return joints;
  }
  /// rad (m): largest difference of these joints.
  static double difference(const JointVector& a, const JointVector& b, const std::vector<int>& joints) {
    double largest = 0.0;
    for (const int k : joints) largest = std::max(largest, std::abs(a[k] - b[k]));
    return largest;
  }
  double speed(int tool) const {
    double largest = 0.0;
    for (const int k : own(tool)) largest = std::max(largest, std::abs(session.last_command.dq[k]));
    return largest;
  }

  const RobotModel& model;
  VirtualSession session;
};

TEST(TwoHands, EngagingOneNeverMovesTheOther) {
  for (const std::string name : {"two_ur5e", "tiago_pro"}) {
    for (const int tool : {0, 1}) {
      TwoHands t(name);
      const std::vector<int> resting = t.model.chain(t.model.tools[1 - tool].link);  // with the torso
      const JointVector before = t.session.last_command.q;
      bool moved = false;
      t.session.on_command = [&](const JointCommand& command) {
        moved = moved || TwoHands::difference(command.q, before, resting) > 0.0;
      };
      ASSERT_TRUE(t.session.grip(tool)) << t.session.view.reason;
      t.session.run(2.0);
      EXPECT_EQ(t.state(tool), State::kEngaged) << t.session.view.hands[tool].reason;
      EXPECT_EQ(t.state(1 - tool), State::kReady);
      EXPECT_FALSE(moved) << name << ", tool " << tool;
      EXPECT_GT(TwoHands::difference(t.session.last_command.q, before, t.own(tool)), 0.02) << name;
    }
  }
}

TEST(TwoHands, BothFollow) {
  for (const std::string name : {"two_ur5e", "tiago_pro"}) {
    TwoHands t(name);
    t.lead_both(1.0);
    double largest[2] = {};
    for (int i = 0; i < 200; ++i) {
      t.session.run(0.01);
      for (const int tool : {0, 1})
        largest[tool] = std::max(largest[tool], t.session.planner_view.tracking_error[tool]);
    }
    EXPECT_LT(largest[0], 0.05) << name;
    EXPECT_LT(largest[1], 0.05) << name;
    EXPECT_GT(t.speed(0), 0.01);
    EXPECT_GT(t.speed(1), 0.01);
  }
}

TEST(TwoHands, OneReleasesAndTheOtherGoesOn) {
  for (const std::string profile : {"tracking", "carry"}) {
    for (const int tool : {0, 1}) {
      TwoHands t("two_ur5e", profile);
      t.lead_both();
      (tool == 0 ? t.session.clutch : t.session.second_clutch) = false;
      EXPECT_TRUE(t.session.run_until([&] { return t.speed(tool) == 0.0; }, 2.5)) << profile << t.speed(tool);
      EXPECT_EQ(t.state(tool), State::kReady);
      EXPECT_EQ(t.state(1 - tool), State::kEngaged) << t.session.view.hands[1 - tool].reason;
      const JointVector rest = t.session.last_command.q;
      t.session.run(1.0);
      EXPECT_EQ(TwoHands::difference(t.session.last_command.q, rest, t.own(tool)), 0.0);
      EXPECT_GT(TwoHands::difference(t.session.last_command.q, rest, t.own(1 - tool)), 0.01);
      EXPECT_TRUE(t.session.grip(tool)) << t.session.view.hands[tool].reason;
      t.session.run(0.5);
      EXPECT_EQ(t.state(1 - tool), State::kEngaged);
    }
  }
}

TEST(TwoHands, AHandThatIsLostRestsBothUntilItIsBack) {
  TwoHands t;
  t.lead_both();
  t.session.channel = [&](OperatorSample sample) {
    sample.tracked = sample.tool == 0;
    t.session.deliver(sample);
  };
  EXPECT_TRUE(t.session.run_until([&] { return t.state(0) == State::kHolding && t.state(1) == State::kHolding; }, 0.2));
  EXPECT_EQ(t.session.view.hands[0].cause.code, ReasonCode::kOtherLost);
  EXPECT_EQ(t.session.view.hands[1].cause.code, ReasonCode::kHandLost);
  EXPECT_TRUE(t.session.run_until([&] { return t.session.at_rest(); }, 1.5));
  t.session.hand = t.session.second_hand = [](double) { return Pose{}; };  // far from where they were lost? near enough
  t.session.channel = [&](const OperatorSample& sample) { t.session.deliver(sample); };
  t.session.run(0.5);
  EXPECT_NE(t.state(0), State::kFault);
}

TEST(TwoHands, AHandThatIsLostRestsItsToolAloneIfSettingsSaySo) {
  TwoHands t("two_ur5e", "tracking", false);
  t.lead_both();
  t.session.channel = [&](OperatorSample sample) {
    sample.tracked = sample.tool == 0;
    t.session.deliver(sample);
  };
  EXPECT_TRUE(t.session.run_until([&] { return t.state(1) == State::kHolding; }, 0.2));
  EXPECT_TRUE(t.session.run_until([&] { return t.speed(1) == 0.0; }, 2.5));
  EXPECT_EQ(t.state(0), State::kEngaged);
  EXPECT_GT(t.speed(0), 0.01);
}

TEST(TwoHands, ADeviceThatIsSilentReleasesBoth) {
  TwoHands t;
  t.lead_both();
  t.session.channel = [&](const OperatorSample& sample) {
    if (sample.tool == 0) t.session.deliver(sample);
  };
  EXPECT_TRUE(t.session.run_until([&] { return t.state(0) == State::kReady && t.state(1) == State::kReady; }, 0.5))
      << t.session.view.hands[0].reason << "; " << t.session.view.hands[1].reason;
  EXPECT_TRUE(t.session.run_until([&] { return t.session.at_rest(); }, 2.0));
  EXPECT_EQ(t.state(0), State::kReady) << "a closed clutch does not engage again";
}

TEST(TwoHands, AStopStopsBoth) {
  TwoHands t;
  t.lead_both();
  t.session.ask_stop();
  EXPECT_TRUE(t.session.run_until([&] { return t.session.at_rest(); }, 1.5));
  EXPECT_EQ(t.state(0), State::kStopping);
  EXPECT_EQ(t.state(1), State::kStopping);
  t.session.ask_reset();
  t.session.run(0.3);
  EXPECT_EQ(t.state(0), State::kReady);
  EXPECT_EQ(t.state(1), State::kReady);
}

TEST(TwoHands, AnArmThatStopsStopsBoth) {
  TwoHands t;
  t.lead_both();
  t.session.arm().trip("protective stop");
  t.session.run(0.05);
  EXPECT_EQ(t.state(0), State::kFault);
  EXPECT_EQ(t.state(1), State::kFault);
  EXPECT_EQ(t.session.view.reason, "protective stop");
}

/// Hands that cross: each tool is led to where the other one is, and back.
TEST(TwoHands, CrossingHandsNeverTouchAndFollowAgain) {
  TwoHands t;
  const auto to_the_other = [&](double sign) {
    return [&t, sign](double now) {
      Pose pose;
      const double share = 0.5 - 0.5 * std::cos(2.0 * M_PI * std::clamp(now / 4.0 - 0.5, 0.0, 1.0));
      pose.p.y() = sign * 0.8 * share;
      return pose;
    };
  };
  t.session.hand = to_the_other(-1.0);
  t.session.second_hand = to_the_other(1.0);
  t.lead_both(0.2);
  t.session.run(7.0);
  EXPECT_LT(t.session.monitor().result().smallest_clearance, 0.1) << "they came near each other";
  EXPECT_EQ(t.state(0), State::kEngaged);
  EXPECT_EQ(t.state(1), State::kEngaged);
  for (const int tool : {0, 1}) EXPECT_LT(t.session.planner_view.tracking_error[tool], 0.01);
}

/// Each hand goes this share of the way from its tool to the other one, waits, and goes back at a time.
struct FaceOff {
  FaceOff(const std::string& profile, double first, double second) : t("two_ur5e", profile) {
    to_other = t.session.glass(t.model.home, 1).p - t.session.glass(t.model.home, 0).p;
    t.session.hand = moving(0, first);
    t.session.second_hand = moving(1, -second);
    t.lead_both(0.1);
    begin = t.session.now();
    t.session.run(5.0);  // 2 s there, 3 s against each other
  }
  std::function<Pose(double)> moving(int tool, double share) {
    return [this, tool, share](double now) {
      const auto smooth = [](double x) { return 0.5 - 0.5 * std::cos(M_PI * std::clamp(x, 0.0, 1.0)); };
      Pose pose;
      pose.p = share * (smooth(0.5 * (now - begin)) - smooth((now - back[tool]) / 1.5)) * to_other;
      return pose;
    };
  }
  /// m, of the tool towards the other side
  double along(int tool) { return t.session.glass(t.session.last_command.q, tool).p.dot(to_other.normalized()); }

  TwoHands t;
  Vector3 to_other;
  double begin = 1e9, back[2] = {1e9, 1e9};
};

TEST(TwoHands, LedIntoEachOtherEachFollowsAgainWithin100Ms) {
  for (const std::string profile : {"tracking", "carry"}) {
    for (const int away : {0, 1}) {
      SCOPED_TRACE(fmt::format("{}, hand {} goes", profile, away));
      FaceOff f(profile, 0.55, 0.55);
      for (const int tool : {0, 1}) {
        EXPECT_EQ(f.t.state(tool), State::kEngaged);
        EXPECT_GT(f.t.session.planner_view.tracking_error[tool], 0.02) << "the other arm is in the way";
        EXPECT_LT(f.t.speed(tool), 0.02) << "waits";
      }
      const double before[2] = {f.along(0), f.along(1)};
      f.back[away] = f.t.session.now();
      // The hand has moved by 3 mm until then.
      f.t.session.run_until([&] { return f.t.session.now() - f.back[away] > 0.08; }, 1.0);
      const double there = f.t.session.now();
      const double sign = away == 0 ? -1.0 : 1.0;  // of both tools
      double took[2] = {1e9, 1e9};
      f.t.session.run_until(
          [&] {
            for (const int tool : {0, 1}) {
              if (sign * (f.along(tool) - before[tool]) > 1e-3)
                took[tool] = std::min(took[tool], f.t.session.now() - there);
            }
            return std::max(took[0], took[1]) < 1.0;
          },
          1.0);
      EXPECT_LT(took[0], 0.1);
      EXPECT_LT(took[1], 0.1);
      f.t.session.run(3.0);
      for (const int tool : {0, 1}) EXPECT_LT(f.t.session.planner_view.tracking_error[tool], 0.01) << tool;
    }
  }
}

/// Weights of one tool are a hundredth: that one makes room for the other, and comes back.
TEST(TwoHands, TheToolOfLessWeightMakesRoom) {
  for (const int light : {0, 1}) {
    SCOPED_TRACE(light);
    const std::string high = "500, 500, 500", low = "5, 5, 5", turn = "5, 5, 5", little = "0.05, 0.05, 0.05";
    const TemporaryFolder folder;
    const std::string profile =
        folder.write("priority.yaml", fmt::format("weights:\n  position: [{}, {}]\n  orientation: [{}, {}]\n"
                                                  "  velocity: 0.1\n  acceleration: 0.02\n",
                                                  light == 0 ? low : high, light == 0 ? high : low,
                                                  light == 0 ? little : turn, light == 0 ? turn : little));
    FaceOff f(profile, 0.5, 0.5);
    const PlannerView& view = f.t.session.planner_view;
    EXPECT_LT(view.tracking_error[1 - light], 0.01);
    EXPECT_GT(view.tracking_error[light], 0.05);
    f.back[1 - light] = f.t.session.now();
    f.t.session.run(4.0);
    EXPECT_LT(view.tracking_error[1 - light], 0.01);
    EXPECT_LT(view.tracking_error[light], 0.03) << "a small weight returns slowly";
  }
}

/// The hands wander against each other by 50 mm while the tools hold a tray: the pose of one in the other stays, and
/// one hand alone moves both.
TEST(TwoHands, ThatHoldOneThingKeepItsPose) {
  TwoHands t("two_ur5e", "tray");
  const auto relative = [&] {
    const JointVector& q = t.session.last_command.q;
    return t.session.glass(q, 0).inverse() * t.session.glass(q, 1);
  };
  const Pose held = relative();
  t.session.hand = [](double now) {
    Pose pose;
    pose.p = {0.08 * std::sin(1.5 * now), 0.06 * std::sin(now), 0.0};
    return pose;
  };
  t.session.second_hand = [&](double now) {
    Pose pose = t.session.hand(now);
    pose.p += 0.05 * Vector3(std::sin(0.9 * now), std::cos(0.7 * now), std::sin(1.1 * now));
    return pose;
  };
  double squares = 0.0, turns = 0.0;
  int cycles = 0;
  t.session.on_command = [&](const JointCommand&) {
    const Pose now = held.inverse() * relative();
    squares += now.p.squaredNorm();
    turns += std::pow(now.q.angularDistance(Quaternion::Identity()), 2);
    ++cycles;
  };
  ASSERT_TRUE(t.session.grip(0)) << t.session.view.reason;
  t.session.run(2.0);
  EXPECT_GT(TwoHands::difference(t.session.last_command.q, t.model.home, t.own(1)), 0.02) << "goes with the other";
  ASSERT_TRUE(t.session.grip(1)) << t.session.view.reason;
  t.session.run(6.0);
  t.session.clutch = t.session.second_clutch = false;
  t.session.run(1.5);
  EXPECT_TRUE(t.session.at_rest());
  EXPECT_LT(std::sqrt(squares / cycles), 1e-3);
  EXPECT_LT(std::sqrt(turns / cycles), 0.2 * M_PI / 180.0);
  EXPECT_FALSE(t.session.spilled()) << "10 mm below the rim";
}

/// Weights of a profile, as a client sets them; its problem must be the one in use.
void use_weights(TwoHands& t, const std::string& profile) {
  const auto weights = t.session.planning().ocp().weights(load_profile(profile)->ocp.weights);
  ASSERT_TRUE(weights) << weights.error().message;
  OperatorSettings settings;
  settings.objectives = static_cast<int>(weights->size());
  std::copy(weights->begin(), weights->end(), settings.weights.begin());
  t.session.set(settings);
}

/// While one arm follows, the tools take one thing where they are, and let go of it again.
TEST(TwoHands, ThatTakeOneThingKeepItsPoseOfThen) {
  TwoHands t("two_ur5e", "tray");
  use_weights(t, "tracking");
  t.session.hand = [](double now) {
    Pose pose;
    pose.p.z() = 0.15 * std::clamp(0.5 * (now - 1.5), 0.0, 1.0);
    return pose;
  };
  t.session.run(0.2);
  ASSERT_TRUE(t.session.grip(0)) << t.session.view.reason;
  t.session.run(4.0);
  const Vector3 before = t.session.glass(t.session.last_command.q, 1).p;
  use_weights(t, "tray");
  t.session.run(1.0);
  EXPECT_EQ(t.state(0), State::kEngaged);
  EXPECT_LT((t.session.glass(t.session.last_command.q, 1).p - before).norm(), 5e-3);
  t.session.hand = [&](double now) {
    Pose pose;
    pose.p.z() = 0.15 + 0.05 * std::sin(2.0 * now);
    return pose;
  };
  t.session.run(1.0);
  EXPECT_GT(t.speed(1), 0.01) << "goes with the other";
  use_weights(t, "tracking");
  EXPECT_TRUE(t.session.run_until([&] { return t.speed(1) == 0.0; }, 2.5));
  EXPECT_EQ(t.state(0), State::kEngaged);
}

/// A clutch that closes and opens all the time moves nothing, and is nothing to the other hand.
TEST(TwoHands, AClutchThatChattersDisturbsNobody) {
  TwoHands t;
  ASSERT_TRUE(t.session.grip(0)) << t.session.view.reason;
  t.session.run(1.0);
  int engaged = 0;
  for (int i = 0; i < 150; ++i) {
    t.session.second_clutch = !t.session.second_clutch;
    t.session.run(0.02);
    engaged += t.state(0) == State::kEngaged;
  }
  EXPECT_EQ(engaged, 150) << t.session.view.hands[0].reason;
}

/// A hand that rushes along waves of its own, and from `start` on goes `across` and back.
std::function<Pose(double)> wild_hand(std::mt19937& random, const Vector3& across, double pace, double start) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  struct Wave {
    Vector3 size, phase;
    double rate;
  };
  std::array<Wave, 3> waves;
  for (Wave& wave : waves) {
    wave = {0.25 * Vector3(unit(random), unit(random), unit(random)),
            3.0 * Vector3(unit(random), unit(random), unit(random)), 0.5 + 3.0 * std::abs(unit(random))};
  }
  const double turn = 0.6 * unit(random);
  return [=](double t) {
    Pose pose;
    for (const Wave& wave : waves) {
      for (int i = 0; i < 3; ++i) pose.p[i] += wave.size[i] * std::sin(wave.rate * t + wave.phase[i]);
    }
    pose.p += across * (0.5 - 0.5 * std::cos(pace * (t - start)));
    pose.q = Eigen::AngleAxisd(turn * std::sin(1.7 * t), Vector3(0.6, 0.0, 0.8));
    return pose;
  };
}

double number_of(const char* variable, double otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atof(text);
}

/// Hands that rush, cross, swap places and reach through each other, and are lost and stopped at random, for
/// STEADYHAND_TEST_SECONDS for each robot and profile, from STEADYHAND_TEST_SEED on. The destructor checks the limits
/// and contacts.
TEST(TwoHands, WildHandsBreakNoPromise) {
  const double seconds = number_of("STEADYHAND_TEST_SECONDS", 6.0);
  const int seed = static_cast<int>(number_of("STEADYHAND_TEST_SEED", 7.0));
  for (const std::string name : {"two_ur5e", "tiago_pro"}) {
    for (const std::string profile : {"tracking", "carry", "tray"}) {
      SCOPED_TRACE(fmt::format("{}, {}, seed {}", name, profile, seed));
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> unit(0.0, 1.0);
      TwoHands t(name, profile);
      VirtualSession& s = t.session;
      const Vector3 to_other = s.glass(t.model.home, 1).p - s.glass(t.model.home, 0).p;
      const MonitorResult& seen = s.monitor().result();
      double following = 0.0;
      const double begin = s.now();
      while (s.now() - begin < seconds && seen.beyond_limits + seen.in_contact + seen.too_fast == 0) {
        const double pace = 0.5 + 3.0 * unit(random), first = 1.4 * unit(random), second = 1.4 * unit(random);
        s.hand = wild_hand(random, first * to_other, pace, s.now());
        s.second_hand = wild_hand(random, -second * to_other, unit(random) < 0.5 ? pace : 3.0 * unit(random), s.now());
        s.clutch = s.second_clutch = false;
        s.run(0.05);
        s.clutch = unit(random) < 0.9;
        s.second_clutch = unit(random) < 0.9;
        s.run(2.0 * unit(random));
        const int lost = static_cast<int>(8.0 * unit(random));  // 0 or 1: that hand
        s.channel = [&s, lost](OperatorSample sample) {
          sample.tracked = sample.tool != lost;
          s.deliver(sample);
        };
        if (unit(random) < 0.2) s.clutch = !s.clutch;
        if (unit(random) < 0.2) s.second_clutch = !s.second_clutch;
        if (unit(random) < 0.1) s.ask_stop();
        following += t.state(0) == State::kEngaged && t.state(1) == State::kEngaged;
        s.run(2.0 * unit(random));
        s.ask_reset();
      }
      EXPECT_GT(following, 0.0);
      if (seconds > 6.0)
        std::printf("%s %s: %llu cycles, nearest %.4f m, both followed in %.0f of the turns, at %.3f s\n", name.c_str(),
                    profile.c_str(), static_cast<unsigned long long>(seen.commands), seen.smallest_clearance, following,
                    s.now());
    }
  }
}

}  // namespace
}  // namespace steadyhand
