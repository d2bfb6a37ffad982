#include "steadyhand/operator/console/session_library.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <future>
#include <limits>
#include <nlohmann/json.hpp>

#include "steadyhand/files/record/recorder.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

TEST(SessionLibrary, OfAFolderThatIsNotThereIsEmpty) {
  TemporaryFolder folder;
  const Result<FreshPage> page = read_library(folder.path() / "none", "/sessions");
  ASSERT_TRUE(page);
  EXPECT_EQ(Json::parse(page->body), Json({{"sessions", Json::array()}}));
  EXPECT_FALSE(page->document);
}

TEST(SessionLibrary, LeavesItsFolderForNobody) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "inside");
  std::ofstream(folder.path() / "secret.mcap") << "secret";
  for (const char* path : {"/sessions/../secret/motion", "/sessions/..%2Fsecret/motion", "/sessions/%2e%2e/motion",
                           "/sessions//motion", "/sessions/a/b/motion", "/sessions/a", "/sessions/a/", "/sessions/",
                           "/sessions/.hidden/motion", "/", "", "/sessions/a\n/motion"}) {
    const Result<FreshPage> page = read_library(folder.path() / "inside", path);
    ASSERT_FALSE(page) << path;
    EXPECT_NE(page.error().message.find("there is /sessions"), std::string::npos) << path;
  }
}

TEST(SessionLibrary, SaysWhatIsWrongWithAFile) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "broken.mcap") << "no MCAP at all";
  for (const char* path : {"/sessions/broken/motion", "/sessions/broken/report.html", "/sessions/missing/motion"}) {
    const Result<FreshPage> page = read_library(folder.path(), path);
    ASSERT_FALSE(page) << path;
    EXPECT_NE(page.error().message.find(".mcap"), std::string::npos) << page.error().message;
  }
}

/// Opening a pipe without a writer would block forever, and with it all later requests.
TEST(SessionLibrary, WaitsForNoPipe) {
  TemporaryFolder folder;
  const std::string pipe = folder.path() / "pipe.mcap";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/zero", folder.path() / "zero.mcap");
  auto asked = std::async(std::launch::async, [&] {
    EXPECT_TRUE(read_library(folder.path(), "/sessions"));
    EXPECT_FALSE(read_library(folder.path(), "/sessions/pipe/motion"));
    EXPECT_FALSE(read_library(folder.path(), "/sessions/zero/motion"));
  });
  EXPECT_EQ(asked.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  while (asked.wait_for(std::chrono::milliseconds(10)) != std::future_status::ready) {
    std::fstream(pipe, std::ios::in | std::ios::out).close();  // lets him go
  }
}

/// An arm may report a value that is not finite for a moment; JSON cannot represent it.
TEST(SessionLibrary, LeavesOutWhatIsNoNumber) {
  TemporaryFolder folder;
  {
    RecorderSettings settings;
    settings.live = true;
    Result<Recorder> recorder = Recorder::create(folder.path() / "gap.mcap", settings);
    ASSERT_TRUE(recorder);
    const std::string robot =
        R"({"joints": [{"name": "a", "type": "revolute"}], "velocity_max": [1], "acceleration_max": [1]})";
    ASSERT_TRUE(recorder->add_metadata("robot", {{"json", robot}}));
    const double none = std::numeric_limits<double>::quiet_NaN();
    for (const auto& [second, q] : {std::pair(1, 0.25), std::pair(2, none), std::pair(3, 0.5)}) {
      const Time now = std::chrono::seconds(second);
      ASSERT_TRUE(recorder->write(JointState{{now, now}, JointVector::Constant(1, q), JointVector::Zero(1)}));
      LiquidState liquid;
      liquid.lateral = second;
      ASSERT_TRUE(recorder->write(now, liquid));
    }
    ASSERT_TRUE(recorder->close());
  }
  const Result<FreshPage> page = read_library(folder.path(), "/sessions/gap/motion");
  ASSERT_TRUE(page) << page.error().message;
  const Json motion = Json::parse(page->body);
  EXPECT_EQ(motion["name"], "gap");
  EXPECT_EQ(motion["t_s"], Json({1.0, 3.0}));
  EXPECT_EQ(motion["q"], Json({{0.25}, {0.5}}));
  EXPECT_TRUE(motion["target"]["t_s"].empty() && motion["events"].empty());
  EXPECT_EQ(motion["gripper"], Json({nullptr, nullptr}));
  EXPECT_TRUE(motion.contains("slosh") && motion["slosh"].is_null());  // the arm was never engaged
  EXPECT_TRUE(motion.contains("off_target_mm") && motion["off_target_mm"].is_null());
  EXPECT_EQ(
      motion["felt"],
      Json({{"t_s", {1.0, 2.0, 3.0}}, {"mean", {1.0, 2.0, 3.0}}, {"largest", {1.0, 2.0, 3.0}}, {"count", {1, 1, 1}}}));
}

PlanStep one_joint_step(double t) {
  PlanStep step;
  step.t_s = t;
  step.q = step.dq = step.ddq = JointVector::Zero(1);
  step.tools[0].X_base_planned = step.tools[0].X_base_target = Pose{};
  return step;
}

/// The comparison takes its figures from here. It must not recompute them from rounded times: the hand may have
/// released between a measurement and its rounded time.
TEST(SessionLibrary, CountsSloshAndDistanceAsTheReportDoes) {
  TemporaryFolder folder;
  const auto path = folder.path() / "slosh.mcap";
  {
    RecorderSettings settings;
    settings.live = true;
    Result<Recorder> recorder = Recorder::create(path, settings);
    ASSERT_TRUE(recorder);
    const std::string robot =
        R"({"joints": [{"name": "a", "type": "revolute"}], "velocity_max": [1], "acceleration_max": [1]})";
    ASSERT_TRUE(recorder->add_metadata("robot", {{"json", robot}}));
    const auto felt = [&](Time at, double lateral) {
      LiquidState liquid;
      liquid.lateral = lateral;
      return recorder->write(at, liquid);
    };
    const auto state = [&](Time at, SupervisionState from, SupervisionState to) {
      return recorder->write(SupervisionChange{at, from, to, ""});
    };
    for (const Time at : {from_seconds(1.0), from_seconds(3.0)}) {
      ASSERT_TRUE(recorder->write(JointState{{at, at}, JointVector::Zero(1), JointVector::Zero(1)}));
    }
    ASSERT_TRUE(state(from_seconds(1.0), SupervisionState::kReady, SupervisionState::kEngaged));
    ASSERT_TRUE(felt(from_seconds(1.0), 4.0004));
    ASSERT_TRUE(felt(from_seconds(1.5), 6.0004));
    ASSERT_TRUE(state(from_seconds(2.00003), SupervisionState::kEngaged, SupervisionState::kReady));
    ASSERT_TRUE(felt(from_seconds(2.00004), 90.0));  // 2.0000 s when rounded
    for (int i = 0; i < 60; ++i) {                   // each second one is too near to be drawn
      PlanStep step = one_joint_step(1.0 + i / 60.0);
      step.tools[0].engaged = i < 40;
      step.tools[0].X_base_target.p.x() = i % 2 == 0 ? 0.01 : 0.03;
      ASSERT_TRUE(recorder->write(step));
    }
    ASSERT_TRUE(recorder->close());
  }
  const Result<FreshPage> page = read_library(folder.path(), "/sessions/slosh/motion");
  ASSERT_TRUE(page) << page.error().message;
  const Json motion = Json::parse(page->body);
  EXPECT_EQ(motion["felt"]["t_s"], Json({1.0, 1.5, 2.0}));
  EXPECT_DOUBLE_EQ(motion["slosh"]["mean"], 5.0004);
  EXPECT_DOUBLE_EQ(motion["slosh"]["largest"], 6.0004);
  EXPECT_EQ(motion["target"]["t_s"].size(), 30u);
  EXPECT_NEAR(motion["off_target_mm"].get<double>(), 20.0, 1e-6);
}

/// A program of a line of shell.
std::filesystem::path script(const TemporaryFolder& folder, const std::string& line) {
  const std::filesystem::path path = folder.path() / "program";
  std::ofstream(path) << "#!/bin/sh\n" << line << "\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

/// The beginning of its file.
std::string text_of(const FreshPage& page) {
  std::string text(std::min<std::size_t>(page.size, 4096), '\0');
  const ssize_t read = pread(fileno(page.file.get()), text.data(), text.size(), 0);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, read)));
  return text;
}

Result<FreshPage> fetch(SessionLibrary& library, const std::string& path) {
  std::promise<Result<FreshPage>> answered;
  library.fetch(path, [&](Result<FreshPage> page) { answered.set_value(std::move(page)); });
  Result<FreshPage> page = answered.get_future().get();
  if (page) page->body = text_of(*page);
  return page;
}

TEST(SessionLibrary, AsksAProgramAndPassesOnWhatItSays) {
  TemporaryFolder folder;
  SessionLibrary library(folder.path(), script(folder, R"(echo "$@"; [ "$5" != /bad ] || { echo why >&2; exit 2; })"));
  const Result<FreshPage> list = fetch(library, "/sessions"), page = fetch(library, "/sessions/a b/report.html");
  ASSERT_TRUE(list && page);
  EXPECT_EQ(list->body, "report --sessions " + folder.path().string() + " --answer /sessions\n");
  EXPECT_EQ(list->type, "application/json");
  EXPECT_FALSE(list->document);
  EXPECT_TRUE(page->document);
  const Result<FreshPage> bad = fetch(library, "/bad");
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().message, "why");
}

TEST(SessionLibrary, AFileIsOpenedAndNotReadWhateverItsSize) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "long.mcap") << "MCAP";
  std::filesystem::resize_file(folder.path() / "long.mcap", (256u << 20) + 1);
  mkfifo((folder.path() / "pipe.mcap").c_str(), 0600);
  SessionLibrary library(folder.path(), "/nowhere/steadyhand");
  const Result<FreshPage> page = fetch(library, "/sessions/long/session.mcap");
  ASSERT_TRUE(page) << page.error().message;
  EXPECT_EQ(page->size, (256u << 20) + 1);
  EXPECT_EQ(page->body.substr(0, 4), "MCAP");
  EXPECT_FALSE(fetch(library, "/sessions/pipe/session.mcap"));
  EXPECT_FALSE(fetch(library, "/sessions/../long/session.mcap"));
}

TEST(SessionLibrary, AnswersInOrderFromItsOwnThread) {
  TemporaryFolder folder;
  std::vector<std::string> answers;
  std::promise<std::thread::id> last;
  SessionLibrary library(folder.path(), script(folder, R"(echo "$5")"));
  for (int i = 0; i < 20; ++i) {
    library.fetch("/" + std::to_string(i), [&, i](const Result<FreshPage>& page) {
      answers.push_back(page ? text_of(*page) : page.error().message);
      if (i == 19) last.set_value(std::this_thread::get_id());
    });
  }
  EXPECT_NE(last.get_future().get(), std::this_thread::get_id());
  for (int i = 0; i < 20; ++i) EXPECT_EQ(answers[i], "/" + std::to_string(i) + "\n");
}

TEST(SessionLibrary, GoesOnAfterAnAnswerThatThrows) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "a.mcap") << "recorded";
  SessionLibrary library(folder.path(), script(folder, R"(echo "$5")"));
  library.fetch("/first", [](const Result<FreshPage>&) { throw std::bad_alloc(); });
  ASSERT_TRUE(library.edit({SessionEdit::Kind::kLabel, "a", "good"}, "", [](const Status&) { throw 7; }));
  EXPECT_TRUE(fetch(library, "/second"));
  EXPECT_EQ(session_label(folder.path(), "a"), "good");
}

TEST(SessionLibrary, EndsWithoutWaitingForAnswers) {
  TemporaryFolder folder;
  const auto begin = std::chrono::steady_clock::now();
  int ended = 0;
  {
    SessionLibrary library(folder.path(), script(folder, "exec sleep 60"));
    for (int i = 0; i < 8; ++i) {
      library.fetch("/sessions", [&](const Result<FreshPage>& page) {
        EXPECT_FALSE(page);
        ended += !page && page.error().message == "the program ends";
      });
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_EQ(ended, 8);
}

TEST(SessionLibrary, SaysSoIfItsProgramIsMissing) {
  TemporaryFolder folder;
  SessionLibrary library(folder.path(), "/nowhere/steadyhand");
  const Result<FreshPage> page = fetch(library, "/sessions");
  ASSERT_FALSE(page);
  EXPECT_NE(page.error().message.find("/nowhere/steadyhand"), std::string::npos);
}

TEST(SessionEdits, LabelRenameAndDeleteWhatIsThere) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "one.mcap") << "1";
  using Kind = SessionEdit::Kind;
  const auto edit = [&](const SessionEdit& what) {
    const Status possible = check_edit(folder.path(), what, "");
    return possible ? carry_out(folder.path(), what) : possible;
  };
  ASSERT_TRUE(edit({Kind::kLabel, "one", "spills at the turn"}));
  EXPECT_EQ(session_label(folder.path(), "one"), "spills at the turn");
  ASSERT_TRUE(edit({Kind::kRename, "one", "two"}));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "one.mcap"));
  EXPECT_EQ(session_label(folder.path(), "two"), "spills at the turn");
  ASSERT_TRUE(edit({Kind::kLabel, "two", ""}));
  EXPECT_EQ(session_label(folder.path(), "two"), "");
  ASSERT_TRUE(edit({Kind::kDelete, "two", ""}));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

std::string content(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Each was possible at the time of its request.
TEST(SessionEdits, OfTwoRenamesToOneNameOneIsCarriedOut) {
  TemporaryFolder folder;
  using Kind = SessionEdit::Kind;
  for (const char* name : {"one", "two"}) {
    folder.write(std::string(name) + ".mcap", name);
    folder.write(std::string(name) + ".label", name);
    ASSERT_TRUE(check_edit(folder.path(), {Kind::kRename, name, "three"}, ""));
  }
  EXPECT_TRUE(carry_out(folder.path(), {Kind::kRename, "one", "three"}));
  const Status second = carry_out(folder.path(), {Kind::kRename, "two", "three"});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().message, "there is a recording 'three' already");
  EXPECT_EQ(content(folder.path() / "three.mcap"), "one");
  EXPECT_EQ(session_label(folder.path(), "three"), "one");
  EXPECT_EQ(content(folder.path() / "two.mcap"), "two");
  EXPECT_EQ(session_label(folder.path(), "two"), "two");
}

/// A label without a recording is not lost either, and does not become that of another recording.
TEST(SessionEdits, ALabelIsNotReplacedByARename) {
  TemporaryFolder folder;
  folder.write("one.mcap", "one");
  folder.write("one.label", "mine");
  folder.write("two.label", "of a recording on another disk");
  const Status renamed = carry_out(folder.path(), {SessionEdit::Kind::kRename, "one", "two"});
  ASSERT_FALSE(renamed);
  EXPECT_NE(renamed.error().message.find("one.label: cannot be changed: File exists"), std::string::npos)
      << renamed.error().message;
  EXPECT_EQ(content(folder.path() / "one.mcap"), "one");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "two.mcap"));
  EXPECT_EQ(session_label(folder.path(), "two"), "of a recording on another disk");
}

/// As check_edit has seen it; by now it has another name, or has gone.
TEST(SessionEdits, WhatIsNoLongerThereIsNeitherLabelledNorDeletedInSilence) {
  TemporaryFolder folder;
  using Kind = SessionEdit::Kind;
  for (const SessionEdit& edit :
       {SessionEdit{Kind::kLabel, "one", "mine"}, {Kind::kRename, "one", "two"}, {Kind::kDelete, "one", ""}}) {
    const Status done = carry_out(folder.path(), edit);
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().message, "there is no recording 'one'");
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

/// The file of what it shall say is made before the old one goes.
TEST(SessionEdits, ALabelThatCannotBeWrittenLeavesTheOldOne) {
  TemporaryFolder folder;
  folder.write("one.mcap", "one");
  folder.write("one.label", "before");
  struct rlimit before {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const struct rlimit full {
    0, before.rlim_max
  };
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  const Status labelled = carry_out(folder.path(), {SessionEdit::Kind::kLabel, "one", "after"});
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(labelled);
  EXPECT_EQ(session_label(folder.path(), "one"), "before");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

TEST(SessionEdits, NoFileSystemReplacesAFile) {
  for (const auto& move : {move_to_free_name, move_over_placeholder}) {
    TemporaryFolder folder;
    folder.write("one", "1");
    folder.write("two", "2");
    EXPECT_EQ(move(folder.path() / "one", folder.path() / "two"), std::errc::file_exists);
    EXPECT_EQ(content(folder.path() / "two"), "2");
    EXPECT_EQ(move(folder.path() / "none", folder.path() / "three"), std::errc::no_such_file_or_directory);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "three"));
    EXPECT_FALSE(move(folder.path() / "one", folder.path() / "three"));
    EXPECT_EQ(content(folder.path() / "three"), "1");
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "one"));
  }
}

/// The second request is answered at once, though a report may delay the first.
TEST(SessionLibrary, ANameIsPromisedToOneRename) {
  TemporaryFolder folder;
  for (const char* name : {"one", "two"}) folder.write(std::string(name) + ".mcap", name);
  SessionLibrary library(folder.path(), script(folder, "sleep 0.2"));
  using Kind = SessionEdit::Kind;
  library.fetch("/sessions", [](const Result<FreshPage>&) {});
  std::promise<bool> done;
  ASSERT_TRUE(library.edit({Kind::kRename, "one", "three"}, "", [&](const Status& s) { done.set_value(bool(s)); }));
  const Status second = library.edit({Kind::kRename, "two", "three"}, "", [](const Status&) {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().message, "there is a recording 'three' already");
  EXPECT_TRUE(done.get_future().get());
  EXPECT_EQ(content(folder.path() / "two.mcap"), "two");
}

TEST(SessionEdits, SayWhatCannotBeDoneAndTouchNothing) {
  TemporaryFolder folder;
  for (const char* name : {"one.mcap", "two.mcap", "now.mcap"}) std::ofstream(folder.path() / name) << "1";
  using Kind = SessionEdit::Kind;
  for (const auto& [edit, why] :
       std::vector<std::pair<SessionEdit, std::string>>{{{Kind::kDelete, "three", ""}, "no recording 'three'"},
                                                        {{Kind::kDelete, "../one", ""}, "no recording"},
                                                        {{Kind::kRename, "one", "two"}, "already"},
                                                        {{Kind::kRename, "one", "../two"}, "no name"},
                                                        {{Kind::kRename, "one", ""}, "no name"},
                                                        {{Kind::kLabel, "one", std::string(121, 'x')}, "121 bytes"},
                                                        {{Kind::kRename, "now", "later"}, "being recorded"},
                                                        {{Kind::kDelete, "now", ""}, "being recorded"}}) {
    const Status possible = check_edit(folder.path(), edit, "now");
    ASSERT_FALSE(possible) << why;
    EXPECT_NE(possible.error().message.find(why), std::string::npos) << possible.error().message;
  }
  EXPECT_TRUE(check_edit(folder.path(), {Kind::kLabel, "now", "mine"}, "now"));
}

}  // namespace
}  // namespace steadyhand
