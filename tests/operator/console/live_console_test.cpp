#include "steadyhand/operator/console/live_console.hpp"

#include <gtest/gtest.h>

#include <mutex>

#include "steadyhand/files/record/session_file.hpp"
#include "support/temporary_folder.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

/// A console with a simulated arm, made as an embedding program does.
struct Console : testing::Test {
  Console() : arm(ur5e(), ur5e().home, {}, clock) {
    for (const char* name : {"tracking", "waiter"}) settings.profiles.push_back(*load_profile(name));
    settings.profile = 1;
    settings.server.port = 0;
    settings.recording_place.path = folder.path();
    settings.live.realtime = false;
    settings.live.planner_rate_hz = 20.0;
    settings.metadata = {{"run", {{"arm", "mine"}}}};
    Recording hand;  // goes up by 0.1 m in a second, gripping
    for (int i = 0; i <= 100; ++i) {
      OperatorSample sample;
      sample.stamp.hand = std::chrono::milliseconds(10 * i);
      sample.X_operator_hand.p.z() = 0.1 * std::min(1.0, 0.01 * i);
      sample.clutch = i > 0;
      hand.samples.push_back(sample);
    }
    settings.recordings = {{"up", hand}};
    callbacks.say = [this](const std::string& text) {
      const std::lock_guard lock(mutex);
      said += text;
    };
  }
  std::string lines() {
    const std::lock_guard lock(mutex);
    return said;
  }
  void run(LiveConsole& console, double seconds) {
    for (const Time end = clock.now() + from_seconds(seconds); clock.now() < end;) {
      clock.sleep_until(console.poll(clock.now()));
    }
  }

  TemporaryFolder folder;
  MonotonicClock clock;
  SimulatedArm arm;
  ConsoleSettings settings;
  ConsoleCallbacks callbacks;
  std::mutex mutex;
  std::string said;
};

TEST_F(Console, LeadsTheArmServesThePageAndRecords) {
  auto made = LiveConsole::make(ur5e(), settings, arm, clock, callbacks);
  ASSERT_TRUE(made) << made.error().message;
  LiveConsole& console = **made;
  EXPECT_EQ(console.profile().name, "waiter");
  ASSERT_TRUE(console.operator_interface().apply({OperatorRequest::Kind::kPlayback, "up", 0.0}, clock.now()));
  const Status started = console.start();
  ASSERT_TRUE(started) << started.error().message;
  ASSERT_NE(console.server(), nullptr);
  EXPECT_NE(lines().find("open  " + console.server()->urls().at(0)), std::string::npos) << lines();
  run(console, 1.0);
  EXPECT_EQ(console.operator_interface().controls().playback, 0);
  console.close_page();
  EXPECT_EQ(console.server(), nullptr);
  const LiveSummary summary = console.finish();
  EXPECT_GT(summary.plans, 0u);
  EXPECT_EQ(summary.failed_plans, 0u);
  console.say_notices();

  const std::string begin = "recorded: ";
  const std::size_t at = lines().find(begin);
  ASSERT_NE(at, std::string::npos) << lines();
  const std::size_t path = at + begin.size();
  const auto session = load_session(lines().substr(path, lines().find('\n', path) - path), {});
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->run("profile"), "waiter");
  EXPECT_EQ(session->run("arm"), "mine");
  EXPECT_EQ(session->names.joints.size(), 6u);
}

TEST_F(Console, AnArmThatStartsInsideAnObjectIsReportedBeforeItMoves) {
  settings.page = false;
  CellObject& ball = settings.live.cell.objects.emplace_back();
  ball.name = "ball";
  ball.shape = Shape::sphere(0.05);
  Kinematics home(ur5e());
  home.set_position(ur5e().home);
  ball.origin = Eigen::Translation3d(home.p());
  auto made = LiveConsole::make(ur5e(), settings, arm, clock, callbacks);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_TRUE((*made)->start());
  const std::string line = "note: the arm is inside the object 'ball': its body '";
  for (int i = 0; i < 1000 && lines().find(line) == std::string::npos; ++i) run(**made, 0.01);
  EXPECT_NE(lines().find(line), std::string::npos) << lines();
  EXPECT_EQ((*made)->session().snapshot().command.dq.size(), 6);
  EXPECT_EQ((*made)->session().snapshot().command.dq.norm(), 0.0) << "nobody has engaged it yet";
  const LiveSummary summary = (*made)->finish();
  (*made)->say_notices();
  EXPECT_EQ(lines().find(line, lines().find(line) + 1), std::string::npos) << "once";
}

OperatorRequest episode(EpisodeMark::Kind kind) {
  OperatorRequest request;
  request.kind = OperatorRequest::Kind::kEpisode;
  request.episode.kind = kind;
  return request;
}

/// An episode counts as kept only if a data set will find it.
TEST_F(Console, AnEpisodeIsKeptOnceItIsRecorded) {
  auto made = LiveConsole::make(ur5e(), settings, arm, clock, callbacks);
  ASSERT_TRUE(made) << made.error().message;
  LiveConsole& console = **made;
  ASSERT_TRUE(console.start());
  using Kind = EpisodeMark::Kind;
  const auto wait_until = [&](const auto& condition) {
    for (int i = 0; i < 500 && !condition(); ++i) run(console, 0.01);
    return condition();
  };
  ASSERT_TRUE(console.apply(episode(Kind::kBegin)));
  OperatorRequest off;
  off.kind = OperatorRequest::Kind::kRecord;
  const Status refused = console.apply(off);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "episode 1 is running; keep or discard it first");
  ASSERT_TRUE(console.apply(episode(Kind::kKeep)));
  EXPECT_TRUE(wait_until([&] { return console.episode().kept == 1; }));

  ASSERT_TRUE(console.apply(episode(Kind::kBegin)));
  run(console, 0.05);
  for (const auto& file : std::filesystem::directory_iterator(folder.path())) std::filesystem::remove(file);
  (void)console.apply(episode(Kind::kKeep));
  EXPECT_TRUE(wait_until([&] { return console.episode().lost == 1; }));
  EXPECT_EQ(console.episode().kept, 1);
  EXPECT_FALSE(console.episode().running);
  EXPECT_NE(lines().find("episode 2 is lost: its recording ended before it was kept\n"), std::string::npos) << lines();
  EXPECT_FALSE(console.apply(episode(Kind::kDiscard)));
}

TEST_F(Console, WithoutAPageNothingIsServed) {
  settings.page = false;
  auto made = LiveConsole::make(ur5e(), settings, arm, clock, callbacks);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_TRUE((*made)->start());
  EXPECT_EQ((*made)->server(), nullptr);
  run(**made, 0.05);
  EXPECT_EQ(lines().find("open "), std::string::npos) << lines();
}

TEST_F(Console, BadSettingsAreRefusedAndLeaveNothing) {
  settings.profile = 2;
  const auto none = LiveConsole::make(ur5e(), settings, arm, clock, callbacks);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("profile 2 of 2"), std::string::npos) << none.error().message;
  settings.profile = 0;
  settings.server.page_folder = folder.path() / "nothing";
  auto made = LiveConsole::make(ur5e(), settings, arm, clock, callbacks);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_FALSE((*made)->start());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace steadyhand
