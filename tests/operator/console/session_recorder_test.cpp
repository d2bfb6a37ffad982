#include "steadyhand/files/archive/session_recorder.hpp"

#include <fstream>
#include <numeric>

#include "steadyhand/report/figures/past_session.hpp"
#include "steadyhand/report/replay/replay.hpp"
#include "support/recorded.hpp"

namespace steadyhand {
namespace {

namespace fs = std::filesystem;

TEST_F(Recorded, EverythingIsInTheFileAndTimesCountFromTheBegin) {
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  EXPECT_TRUE(recorder.recording());
  run(taps, 2.0);
  recorder.finish({});
  ASSERT_EQ(files().size(), 1u);
  const SessionFile session = read(files()[0]);
  EXPECT_TRUE(session.overview.complete);
  EXPECT_EQ(session.commands.size(), 1000u);
  EXPECT_EQ(session.states.size(), 1000u);
  EXPECT_EQ(session.samples.size(), 200u);
  EXPECT_EQ(session.commands.front().stamp.made, Time(0));
  EXPECT_NEAR(session.duration(), 2.0, 0.02);
  const auto notices = recorder.take_notices();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_NE(notices[0].find(files()[0].string()), std::string::npos);
  EXPECT_TRUE(recorder.take_notices().empty());
}

/// In force when a file begins, and each change.
TEST_F(Recorded, AFileThatEndsBeforeItsSessionHasASummary) {
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  SessionSnapshot snapshot;
  const auto look = [&](double seconds, SupervisionState state, bool spilled) {
    const SupervisionChange change{now + std::chrono::milliseconds(3), snapshot.state, state, "", false};
    if (state != snapshot.state) taps.change(change);
    snapshot.state = state;
    snapshot.tools[0].liquid.spilled = spilled;
    snapshot.tools[0].liquid.spilled_share = spilled ? 0.25 : 0.0;
    for (const Time end = now + from_seconds(seconds); now < end; now += std::chrono::milliseconds(10)) {
      snapshot.now = now;
      taps.look(snapshot);
    }
  };
  const auto choose = [&](const char* profile) {
    AppliedSettings applied;
    applied.at = now;
    applied.settings.profile = profile;
    taps.settings(applied);
  };
  choose("carry");
  snapshot.now = Time(0);  // nothing has run yet
  taps.look(snapshot);
  now += std::chrono::milliseconds(5);
  const Time first = now;
  look(0.5, SupervisionState::kReady, false);
  look(0.05, SupervisionState::kEngaged, false);  // in passing
  choose("follow");
  look(0.25, SupervisionState::kEngaged, false);
  choose("tracking");
  look(3.7, SupervisionState::kEngaged, true);
  look(0.5, SupervisionState::kReady, false);
  recorder.ask(false);
  look(0.1, SupervisionState::kReady, false);
  const std::vector<SessionEntry> sessions = list_sessions(place.path);
  ASSERT_EQ(sessions.size(), 1u);
  EXPECT_TRUE(sessions[0].complete);
  EXPECT_EQ(sessions[0].summary.at("spilled"), "yes");
  EXPECT_EQ(sessions[0].summary.at("spills"), "1");
  EXPECT_EQ(sessions[0].summary.at("spilled_share"), "0.25");
  EXPECT_EQ(sessions[0].summary.at("profiles"), "tracking, follow");
  EXPECT_NEAR(std::stod(sessions[0].summary.at("engaged_s")), 4.0, 1e-6);  // as exactly as its changes tell
  EXPECT_NEAR(std::stod(sessions[0].summary.at("duration_s")), to_seconds(now - first) - 0.1, 0.05);
  EXPECT_EQ(sessions[0].fault, "");
}

TEST_F(Recorded, EveryFileTellsWhatStandsAroundTheArm) {
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  taps.cell(now, {"desk", {}});
  run(taps, 0.5);
  taps.cell(now, {"desk", {{"ball", Shape::sphere(0.1), Eigen::Isometry3d::Identity()}}});
  run(taps, 0.5);
  recorder.ask(false);
  run(taps, to_seconds(SessionRecorder::kShortestFile));
  recorder.ask(true);
  run(taps, 0.1);
  recorder.finish({});
  const auto told = [](const fs::path& path) {
    std::vector<std::string> cells;
    const auto overview = read_mcap(path, [&](const McapMessage& message) -> Status {
      if (message.topic == "/cell") cells.emplace_back(message.data);
      return Done{};
    });
    EXPECT_TRUE(overview);
    return cells;
  };
  ASSERT_EQ(files().size(), 2u);
  const auto first = told(files()[0]), second = told(files()[1]);
  ASSERT_EQ(first.size(), 2u);
  EXPECT_EQ(first[0].find("ball"), std::string::npos) << first[0];
  EXPECT_NE(first[1].find("ball"), std::string::npos) << first[1];
  ASSERT_EQ(second.size(), 1u);
  EXPECT_NE(second[0].find("ball"), std::string::npos) << second[0];
}

TEST_F(Recorded, CommandsOfALongSessionAreReadMergedWithoutLosingTheLargest) {
  SessionRecorder recorder = make();
  const LiveTaps taps = recorder.taps();
  std::vector<double> speeds;
  for (int i = 0; i < 777; ++i) {
    now += std::chrono::milliseconds(2);
    const double speed = std::sin(0.37 * i * i);
    speeds.push_back(std::abs(speed));
    const JointVector dq = JointVector::Constant(6, speed);
    taps.command({{now, now}, JointVector::Zero(6), dq, -2.0 * dq});
  }
  recorder.finish({});
  SessionParts parts;
  parts.commands = true;
  parts.most_commands = 100;
  const auto session = load_session(files().at(0), parts);
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->commands_merged, 8);
  ASSERT_EQ(session->commands.size(), 98u);  // 777 / 8, rounded up
  for (std::size_t k = 0; k < session->commands.size(); ++k) {
    const auto first = speeds.begin() + static_cast<std::ptrdiff_t>(8 * k);
    const double largest = *std::max_element(first, std::min(first + 8, speeds.end()));
    EXPECT_NEAR(session->commands[k].dq.cwiseAbs()[0], largest, 1e-9) << k;
    EXPECT_NEAR(session->commands[k].ddq.cwiseAbs()[5], 2.0 * largest, 1e-9) << k;
    EXPECT_EQ(session->commands[k].stamp.made,
              8 * k * Time(std::chrono::milliseconds(2)) + std::chrono::milliseconds(2));
  }
}

/// The cells of the last second, and the one before them as it was at its begin.
TEST_F(Recorded, AFaultLeavesTheCellsOfTheSecondsBeforeIt) {
  settings.enabled = false;
  settings.flight_seconds = 1.0;
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  const auto ball = [](double x, double velocity) {
    CellObject object;
    object.name = "ball";
    object.shape = Shape::sphere(0.1);
    object.origin = Eigen::Translation3d(x, 0.0, 2.0) * Eigen::Isometry3d::Identity();
    object.velocity.x() = velocity;
    object.may_be_touched_by = {"wrist_3_link"};
    return Cell{"cell", {object}};
  };
  taps.cell(now, ball(1.0, 0.0));
  run(taps, 1.0);
  taps.cell(now, ball(2.0, 0.1));
  run(taps, 1.5);
  taps.cell(now, ball(3.0, 0.0));
  run(taps, 0.5);
  taps.change({now, SupervisionState::kEngaged, SupervisionState::kFault, "emergency button", true});
  run(taps, 0.1);
  ASSERT_EQ(files().size(), 1u);
  const SessionFile flight = read(files()[0]);
  ASSERT_EQ(flight.cells.size(), 2u);
  EXPECT_NEAR(to_seconds(flight.cells[1].at - flight.cells[0].at), 0.5, 0.01);
  EXPECT_NEAR(flight.cells[0].cell.objects.at(0).origin.translation().x(), 2.1, 1e-2) << "it had flown on";
  EXPECT_EQ(flight.cells[1].cell.objects.at(0).origin.translation().x(), 3.0);
  EXPECT_EQ(flight.cells[1].cell.objects.at(0).may_be_touched_by, std::vector<std::string>{"wrist_3_link"});
}

TEST_F(Recorded, AFaultLeavesTheSecondsBeforeItInAFileOfItsOwn) {
  settings.enabled = false;
  settings.flight_seconds = 1.0;
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  run(taps, 3.0);
  EXPECT_TRUE(files().empty());
  taps.change({now, SupervisionState::kEngaged, SupervisionState::kFault, "emergency button", true});
  run(taps, 1.0);
  ASSERT_EQ(files().size(), 1u);
  EXPECT_NE(files()[0].string().find("-fault-1.mcap"), std::string::npos);
  const SessionFile flight = read(files()[0]);
  EXPECT_TRUE(flight.overview.complete);
  EXPECT_EQ(flight.overview.metadata.at("fault").at("reason"), "emergency button");
  EXPECT_EQ(list_sessions(files()[0].parent_path()).at(0).fault, "emergency button");
  EXPECT_NEAR(static_cast<double>(flight.commands.size()), 500.0, 5.0);
  EXPECT_NEAR(to_seconds(flight.commands.back().stamp.made), 3.0, 0.02);
  ASSERT_EQ(flight.changes.size(), 1u);
  EXPECT_EQ(flight.changes[0].to, "fault");

  // A stop on request is no fault, and the second fault does not overwrite the first.
  taps.change({now, SupervisionState::kReady, SupervisionState::kStopping, "a stop was asked for", false});
  run(taps, 0.1);
  EXPECT_EQ(files().size(), 1u);
  taps.change({now, SupervisionState::kReady, SupervisionState::kStopping, "the loop slept", true});
  run(taps, 0.1);
  EXPECT_EQ(files().size(), 2u);
}

TEST_F(Recorded, TheOperatorBeginsAndEndsFiles) {
  settings.enabled = false;
  settings.flight_seconds = 0.0;
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  for (std::size_t i = 1; i <= 3; ++i) {
    run(taps, 0.2);
    EXPECT_FALSE(recorder.recording());
    recorder.ask(true);
    run(taps, 0.3);
    EXPECT_TRUE(recorder.recording());
    recorder.ask(false);
    run(taps, to_seconds(SessionRecorder::kShortestFile));
    ASSERT_EQ(files().size(), i);
  }
  for (const fs::path& path : files()) EXPECT_TRUE(read(path).overview.complete);
}

/// A file every kShortestFile at most. All that was wanted is recorded.
TEST_F(Recorded, WhoAsksAgainAndAgainGetsFewFilesAndAllThatWasWanted) {
  settings.enabled = false;
  settings.flight_seconds = 0.0;
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  std::size_t wanted = 0;
  for (int i = 0; i < 360; ++i) {
    const bool record = i % 2 == 0;
    recorder.ask(record);
    run(taps, 0.02);
    EXPECT_TRUE(!record || recorder.recording()) << i;
    wanted += record ? 10 : 0;
  }
  run(taps, to_seconds(SessionRecorder::kShortestFile));
  EXPECT_FALSE(recorder.recording());
  const std::size_t most = static_cast<std::size_t>(360 * 0.02 / to_seconds(SessionRecorder::kShortestFile)) + 1;
  EXPECT_LE(files().size(), most);
  std::size_t commands = 0;
  for (const fs::path& path : files()) {
    const SessionFile session = read(path);
    EXPECT_TRUE(session.overview.complete);
    commands += session.commands.size();
  }
  EXPECT_GT(commands, wanted - 10 * most);  // a file begins with the look after the first messages
}

/// The loss is reported, and a new file has what follows. The recorder never reports a missing file as recorded.
TEST_F(Recorded, AFileThatIsDeletedOrMovedAwayIsFollowedByAnother) {
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  run(taps, 0.5);
  ASSERT_EQ(files().size(), 1u);
  fs::remove_all(place.path);
  run(taps, 2.0);
  EXPECT_TRUE(recorder.recording());
  ASSERT_EQ(files().size(), 1u);
  const fs::path moved = folder.path() / "moved.mcap";
  fs::rename(files()[0], moved);
  run(taps, 2.0);
  EXPECT_TRUE(read(moved).overview.complete);
  ASSERT_EQ(files().size(), 1u);
  const fs::path last = files()[0];
  fs::remove(last);
  recorder.finish({});
  const auto notices = recorder.take_notices();
  ASSERT_EQ(notices.size(), 3u);
  for (const std::string& line : notices) {
    EXPECT_EQ(line.rfind("the recording was deleted or moved away: ", 0), 0u) << line;
  }
}

TEST_F(Recorded, AFolderThatCannotBeMadeAndADiskThatIsFullEndTheRecordingOnly) {
  std::ofstream(folder.path() / "file") << "";
  place.path = folder.path() / "file/sessions";
  SessionRecorder recorder = make();
  EXPECT_FALSE(recorder.recording());
  const auto notices = recorder.take_notices();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_NE(notices[0].find("not recorded"), std::string::npos);
  LiveTaps taps = recorder.taps();
  run(taps, 1.0);
  recorder.finish({});

  Result<McapWriter> full = McapWriter::create("/dev/full");
  EXPECT_FALSE(full);  // its header does not fit
}

TEST_F(Recorded, ADiskThatIsNearlyFullIsLeftAlone) {
  place.keep_free_gb = 1e6;
  SessionRecorder recorder = make();
  EXPECT_FALSE(recorder.recording());
  LiveTaps taps = recorder.taps();
  run(taps, 1.5);
  EXPECT_TRUE(files().empty());
  const auto notices = recorder.take_notices();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_NE(notices[0].find("GB"), std::string::npos) << notices[0];
}

/// At the begin of each file those that are in force, then every change, at its time.
TEST_F(Recorded, WhatTheOperatorSetComesBackAndIsReplayed) {
  settings.enabled = false;
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  AppliedSettings applied;
  applied.at = now;
  applied.settings.objectives = static_cast<int>(ocp.objectives().size());
  const auto weights = ocp.weights(load_profile("waiter")->ocp.weights);
  ASSERT_TRUE(weights);
  std::copy(weights->begin(), weights->end(), applied.settings.weights.begin());
  applied.settings.scale = 1.0;
  applied.settings.yaw = 0.0;
  taps.settings(applied);
  run(taps, 1.0);
  recorder.ask(true);
  run(taps, 2.0);
  applied.at = now;
  applied.settings.scale = 0.25;
  applied.settings.weights[1].setConstant(7.0);
  taps.settings(applied);
  run(taps, 1.0);
  recorder.finish({});

  SessionFile session = read(files()[0]);
  EXPECT_NEAR(session.duration(), 3.0, 0.02);
  ASSERT_EQ(session.settings.size(), 2u);
  EXPECT_NEAR(to_seconds(session.settings[0].at), 1.0, 0.02);
  EXPECT_EQ(session.settings[1].at, from_seconds(3.0));
  EXPECT_EQ(session.settings[1].scale, 0.25);
  const auto back = ocp.weights(session.settings[1].weights);
  ASSERT_TRUE(back) << back.error().message;
  for (std::size_t i = 0; i < back->size(); ++i) EXPECT_EQ((*back)[i], applied.settings.weights[i]) << i;

  for (OperatorSample& sample : session.samples) {  // a hand that moves
    sample.X_operator_hand = sweeping({0.1, 0.1, 0.05})(to_seconds(sample.stamp.hand));
  }
  auto hand = hand_of_session(session, {}, {});
  ASSERT_TRUE(hand) << hand.error().message;
  EXPECT_NEAR(to_seconds(hand->changes[1].at), 2.0, 0.02);
  ReplaySettings same, changed;
  same.pipeline = changed.pipeline = PipelineSettings(*load_profile("waiter"));
  changed.changes = hand->changes;
  same.changes = {hand->changes[0]};
  const auto driven = replay(ur5e(), hand->recording, changed, {}), without = replay(ur5e(), hand->recording, same, {});
  ASSERT_TRUE(driven && without);
  const auto apart = [&](double from, double until) {
    double most = 0.0;
    for (std::size_t i = 0; i < driven->commands.size(); ++i) {
      const double t = to_seconds(driven->commands[i].stamp.made);
      if (t < from || t >= until) continue;
      most = std::max(most, (driven->commands[i].q - without->commands[i].q).cwiseAbs().maxCoeff());
    }
    return most;
  };
  EXPECT_EQ(apart(0.0, 1.98), 0.0);
  EXPECT_GT(apart(2.0, 3.0), 0.01);
  changed.changes[1].weights["nothing"] = {1.0};
  const auto refused = replay(ur5e(), hand->recording, changed, {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("nothing"), std::string::npos) << refused.error().message;
}

/// A term's share of J is its weighted value, so the shares add up to J.
TEST_F(Recorded, SharesOfTheObjectiveAddUpToIt) {
  VirtualSession::Options options;
  options.profile = "carry";
  VirtualSession session(options);
  session.hand = sweeping({0.2, 0.2, 0.1});
  const Ocp& planned = session.planning().ocp();
  SessionRecorder recorder(planned, settings, {{"robot", {{"json", robot_json(ur5e())}}}}, Time(0),
                           std::make_unique<RecordingFolder>(place));
  LiveTaps taps = recorder.taps();
  std::vector<double> objectives;
  ASSERT_TRUE(session.grip());
  session.run(0.5);
  PlanningRecord step;
  const auto take = [&] {
    while (session.planner_side().taps.steps.pop(step)) {
      taps.step(step);
      objectives.push_back(step.solved.objective);
    }
  };
  take();
  for (int i = 0; i < 50; ++i) {
    session.run(0.02);
    take();
  }
  recorder.finish({});
  SessionParts parts;
  parts.steps = true;
  const auto recorded = load_session(files().at(0), parts);
  ASSERT_TRUE(recorded) << recorded.error().message;
  ASSERT_EQ(recorded->steps.size(), objectives.size());
  std::size_t moved = 0;
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    const PlanStep& each = recorded->steps[i];
    if (each.status != PlanOrigin::kSolved || !each.tools[0].engaged) continue;
    ++moved;
    const double sum = std::accumulate(each.shares.begin(), each.shares.end(), 0.0);
    EXPECT_NEAR(sum, objectives[i], 1e-9 * objectives[i]) << i;
  }
  EXPECT_GT(moved, 30u);
}

TEST_F(Recorded, TheHandComesBackAsTheGateLetItThrough) {
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  for (int i = 0; i < 300; ++i) {
    OperatorSample sample;
    const Time t = begin + std::chrono::milliseconds(11 * i);
    sample.stamp = {t, t};
    sample.X_operator_hand.p.x() = 0.001 * i;
    sample.clutch = i > 20;
    if (i == 100) sample.X_operator_hand.p.x() = std::numeric_limits<double>::quiet_NaN();
    if (i == 200) sample.X_operator_hand.p.x() += 0.7;  // a teleport
    if (i == 250) sample.stamp.hand -= std::chrono::milliseconds(100);
    taps.sample(sample);
  }
  recorder.finish({});
  SessionParts parts;
  parts.samples = true;
  const auto session = load_session(files()[0], parts);
  ASSERT_TRUE(session) << session.error().message;
  ASSERT_EQ(session->samples.size(), 300u);
  const auto hand = hand_of_session(*session, {}, {});
  ASSERT_TRUE(hand) << hand.error().message;
  EXPECT_EQ(hand->recording.samples.size(),
            298u);  // without the one that is no number and the one that came out of order
  int open = 0;
  for (std::size_t i = 1; i < hand->recording.samples.size(); ++i) {
    EXPECT_GT(hand->recording.samples[i].stamp.hand, hand->recording.samples[i - 1].stamp.hand);
    open += i > 30 && !hand->recording.samples[i].clutch;
  }
  EXPECT_GT(open, 0);   // where it could not be trusted
  EXPECT_LT(open, 20);  // and it was trusted again
  RecordingOptions none;
  none.from = 1e6;
  EXPECT_FALSE(hand_of_session(*session, none, {}));
  const auto report = report_of_session(*session, "");
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message.find("nothing was planned"), std::string::npos);
}

}  // namespace
}  // namespace steadyhand
