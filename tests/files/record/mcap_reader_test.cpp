// Reads back what McapWriter wrote: whole, cut anywhere, and with bytes changed at random.
#include "steadyhand/files/record/mcap_reader.hpp"

#include <gtest/gtest.h>

#include "steadyhand/files/record/mcap_writer.hpp"
#include "steadyhand/files/record/recorder.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "support/temporary_folder.hpp"
#include "test_data.hpp"

namespace steadyhand {
namespace {

constexpr int kMessages = 400;

std::string written(const std::filesystem::path& path) {
  Result<McapWriter> writer = McapWriter::create(path, {.chunk_bytes = 900});
  EXPECT_TRUE(writer) << writer.error().message;
  EXPECT_TRUE(writer->add_metadata("run", {{"profile", "waiter"}, {"rate", "50"}}));
  const auto first = writer->add_channel({"/first", "Shared", "{}", {{"unit", "rad"}}});
  const auto second = writer->add_channel({"/second", "Shared", "{}", {}});
  for (int i = 0; i < kMessages; ++i) {
    const Time t = std::chrono::milliseconds(10 * (i + 1));
    EXPECT_TRUE(writer->write(i % 3 ? first : second, t, t / 2, "{\"i\":" + std::to_string(i) + "}"));
  }
  EXPECT_TRUE(writer->close());
  return test::read_file(path);
}

void write_file(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(McapReader, GivesBackEveryMessage) {
  const auto path = test::temporary_file("reader.mcap");
  (void)written(path);
  int i = 0;
  const auto overview = read_mcap(path, [&](const McapMessage& message) -> Status {
    EXPECT_EQ(message.topic, i % 3 ? "/first" : "/second");
    EXPECT_EQ(message.encoding, "json");
    EXPECT_EQ(message.channel_metadata->size(), i % 3 ? 1u : 0u);
    EXPECT_EQ(message.log, std::chrono::milliseconds(10 * (i + 1)));
    EXPECT_EQ(message.publish, message.log / 2);
    EXPECT_EQ(message.data, "{\"i\":" + std::to_string(i) + "}");
    ++i;
    return Done{};
  });
  ASSERT_TRUE(overview) << overview.error().message;
  EXPECT_EQ(i, kMessages);
  EXPECT_TRUE(overview->complete);
  EXPECT_EQ(overview->metadata.at("run").at("profile"), "waiter");

  const auto outside = read_mcap(path);
  ASSERT_TRUE(outside);
  EXPECT_EQ(outside->chunks, overview->chunks);
  EXPECT_EQ(outside->first, std::chrono::milliseconds(10));
  EXPECT_EQ(outside->last, std::chrono::milliseconds(10 * kMessages));
  EXPECT_TRUE(outside->complete);
  EXPECT_EQ(outside->metadata, overview->metadata);
}

TEST(McapReader, CutAnywhereGivesItsCompleteChunks) {
  const auto path = test::temporary_file("cut.mcap");
  const std::string bytes = written(path);
  std::mt19937 random(5);
  std::size_t before = 0;
  int messages_before = 0;
  std::vector<std::size_t> cuts;
  for (int i = 0; i < 100; ++i) cuts.push_back(8 + random() % (bytes.size() - 8));
  std::sort(cuts.begin(), cuts.end());
  for (const std::size_t cut : cuts) {
    write_file(path, bytes.substr(0, cut));
    int messages = 0;
    const auto overview = read_mcap(path, [&](const McapMessage&) -> Status {
      ++messages;
      return Done{};
    });
    ASSERT_TRUE(overview) << overview.error().message;
    EXPECT_FALSE(overview->complete && cut + 8 + 29 < bytes.size());
    EXPECT_GE(messages, messages_before) << cut << " after " << before;
    EXPECT_EQ(read_mcap(path)->chunks, overview->chunks);
    before = cut;
    messages_before = messages;
  }
  EXPECT_GT(messages_before, kMessages / 2);
}

/// Indices of the messages that are read.
std::vector<int> indices_in(const std::filesystem::path& path, Result<McapOverview>& overview) {
  std::vector<int> indices;
  overview = read_mcap(path, [&](const McapMessage& message) -> Status {
    indices.push_back(std::stoi(std::string(message.data.substr(5))));
    EXPECT_EQ(message.topic, indices.back() % 3 ? "/first" : "/second");
    return Done{};
  });
  return indices;
}

TEST(McapReader, KeepsWhatIsBeforeAndAfterADamagedPart) {
  const auto path = test::temporary_file("damaged.mcap");
  const std::string bytes = written(path);
  std::vector<std::size_t> chunks;
  for (std::size_t at = bytes.find("zstd"); at < bytes.size() * 7 / 10; at = bytes.find("zstd", at + 1)) {
    chunks.push_back(at - 41);
  }
  ASSERT_GT(chunks.size(), 8u);
  // In the chunk's head: opcode (turned into none, another that is skipped, or the footer's), length, size. Then
  // contents.
  constexpr std::pair<std::size_t, int> kDamages[] = {{0, 0x55},  {0, 0x86},  {0, 0x04}, {0, 0x01},
                                                      {1, 0xff},  {2, 0x7f},  {4, 0x55}, {7, 0x55},
                                                      {25, 0x55}, {44, 0x55}, {60, 0x55}};
  for (const std::size_t chunk : {chunks[0], chunks[4]}) {
    for (const auto& [offset, bits] : kDamages) {
      std::string changed = bytes;
      changed[chunk + offset] = static_cast<char>(changed[chunk + offset] ^ bits);
      write_file(path, changed);
      Result<McapOverview> overview = Error{};
      const std::vector<int> read = indices_in(path, overview);
      ASSERT_TRUE(overview) << overview.error().message;
      EXPECT_GT(read.size(), kMessages * 8u / 10u) << offset << ", " << bits;
      // A chunk whose stated length is too large can be read.
      EXPECT_TRUE(read.size() < std::size_t(kMessages) || offset == 1 || offset == 2) << offset << ", " << bits;
      EXPECT_TRUE(std::is_sorted(read.begin(), read.end()));
      EXPECT_EQ(read.back(), kMessages - 1);
      EXPECT_TRUE(overview->complete);
      ASSERT_EQ(overview->lost.size(), 1u) << offset << ", " << bits;
      const McapLoss& loss = overview->lost[0];
      EXPECT_TRUE(loss.at == chunk || offset == 1 || offset == 2) << offset << ", " << bits;
      for (int i = 0; i < kMessages; ++i) {
        const Time t = std::chrono::milliseconds(10 * (i + 1));
        const bool was_read = std::binary_search(read.begin(), read.end(), i);
        EXPECT_TRUE(was_read || (loss.first < t && t < loss.last)) << i;
      }
      EXPECT_NE(to_text(loss).find("are damaged"), std::string::npos);
      const auto outside = read_mcap(path);
      ASSERT_TRUE(outside) << outside.error().message;
      EXPECT_TRUE(outside->complete);
      EXPECT_EQ(outside->last, overview->last);
    }
  }
}

TEST(McapReader, ChangedBytesCostOnlyWhatIsNoted) {
  const auto path = test::temporary_file("changed.mcap");
  const std::string bytes = written(path);
  std::mt19937 random(6);
  int damaged = 0;
  for (int i = 0; i < 400; ++i) {
    std::string changed = bytes;
    for (int n = 1 + static_cast<int>(random() % 3); n > 0; --n) {
      changed[random() % changed.size()] = static_cast<char>(random());
    }
    write_file(path, changed);
    Result<McapOverview> overview = Error{};
    const std::vector<int> read = indices_in(path, overview);
    (void)read_mcap(path);
    if (!overview) {
      EXPECT_NE(overview.error().message.find("changed.mcap"), std::string::npos);
      continue;
    }
    EXPECT_TRUE(std::is_sorted(read.begin(), read.end()));
    EXPECT_EQ(std::adjacent_find(read.begin(), read.end()), read.end());
    EXPECT_GT(read.size(), kMessages / 3u);
    if (read.size() == kMessages) continue;
    ++damaged;
    EXPECT_TRUE(!overview->lost.empty() || !overview->complete);
  }
  EXPECT_GT(damaged, 100);
}

/// The head of a chunk that cannot be unpacked; its stated length is `length` bytes.
std::string false_chunk(std::uint64_t length) {
  std::string chunk(9 + 28, '\0');
  chunk[0] = 6;  // the opcode
  std::memcpy(chunk.data() + 1, &length, sizeof(length));
  return chunk + std::string("\4\0\0\0zstd", 8) + "\3\0\0\0\0\0\0\0none";
}

/// A file can be made so that each search for a chunk takes long: it reads on after some of them only.
TEST(McapReader, SearchesForAWholeChunkForABoundedTime) {
  const auto path = test::temporary_file("made.mcap");
  const std::string bytes = written(path);
  const std::size_t chunk = bytes.find("zstd", bytes.size() / 2) - 41;
  const std::string before = bytes.substr(0, chunk) + "\x7f", after = bytes.substr(chunk);
  const auto read = [&](const std::string& between) {
    write_file(path, before + between + after);
    Result<McapOverview> overview = Error{};
    const std::vector<int> indices = indices_in(path, overview);
    EXPECT_TRUE(overview && !overview->lost.empty());
    EXPECT_EQ(overview->complete, indices.back() == kMessages - 1);
    EXPECT_EQ(overview->lost.back().reason == "too damaged to read further", !overview->complete);
    return overview->complete;
  };
  const auto several = [](int count, std::uint64_t length) {
    std::string all;
    for (int i = 0; i < count; ++i) all += false_chunk(length);
    return all;
  };
  EXPECT_TRUE(read(several(90, 50)));
  EXPECT_FALSE(read(several(110, 50)));
  const std::string long_one(16u << 20, '.');  // bytes, which each of these would have be read
  EXPECT_TRUE(read(several(5, long_one.size()) + long_one));
  EXPECT_FALSE(read(several(60, long_one.size()) + long_one));
}

TEST(McapReader, EndsAfterAThousandDamagedParts) {
  const auto path = test::temporary_file("parts.mcap");
  constexpr int kParts = 1100;
  for (const int damaged : {900, kParts}) {
    Result<McapWriter> writer = McapWriter::create(path, {.chunk_bytes = 1});
    ASSERT_TRUE(writer) << writer.error().message;
    const auto channel = writer->add_channel({"/first", "Shared", "{}", {}});
    for (int i = 0; i < 2 * kParts; ++i) {
      const Time t = std::chrono::milliseconds(i + 1);
      ASSERT_TRUE(writer->write(channel, t, t, std::to_string(i)));
    }
    ASSERT_TRUE(writer->close());
    std::string bytes = test::read_file(path);
    int chunks = 0, changed = 0;
    for (std::size_t at = bytes.find("zstd"); changed < damaged && at != std::string::npos;
         at = bytes.find("zstd", at + 1)) {
      if (++chunks % 2 == 0) continue;
      bytes[at - 41] = 0x53;  // no record begins there
      bytes[at] = 'Z';
      ++changed;
    }
    ASSERT_EQ(changed, damaged);
    write_file(path, bytes);
    const auto overview = read_mcap(path, [](const McapMessage&) -> Status { return Done{}; });
    ASSERT_TRUE(overview) << overview.error().message;
    EXPECT_EQ(overview->complete, damaged < 1000);
    EXPECT_LE(overview->lost.size(), 1001u);
  }
}

TEST(McapReader, RefusesAFileOfWhichNothingCanBeRead) {
  const auto path = test::temporary_file("all.mcap");
  std::string bytes = written(path);
  for (std::size_t at = bytes.find("zstd"); at != std::string::npos; at = bytes.find("zstd", at + 1)) bytes[at] = 'Z';
  write_file(path, bytes);
  Result<McapOverview> overview = Error{};
  EXPECT_TRUE(indices_in(path, overview).empty());
  ASSERT_FALSE(overview);
  EXPECT_NE(overview.error().message.find("corrupt at byte"), std::string::npos) << overview.error().message;
}

TEST(McapReader, TellsWhatIsNoMcap) {
  const auto path = test::temporary_file("none.mcap");
  for (const std::string& bytes : {std::string(), std::string("t,px"), std::string("\x89MCAP1\r\n", 8)}) {
    write_file(path, bytes);
    EXPECT_FALSE(is_mcap(path));
    const auto overview = read_mcap(path);
    ASSERT_FALSE(overview);
    EXPECT_NE(overview.error().message.find("is no MCAP file"), std::string::npos) << overview.error().message;
  }
  write_file(path, "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n");
  EXPECT_NE(read_mcap(path).error().message.find("is a Git LFS pointer"), std::string::npos);
  EXPECT_FALSE(read_mcap(test::temporary_file("missing.mcap")));
  EXPECT_FALSE(is_mcap(test::temporary_file(".")));
}

TEST(McapReader, EndsWithTheHandlersError) {
  const auto path = test::temporary_file("handler.mcap");
  (void)written(path);
  int messages = 0;
  const auto overview = read_mcap(path, [&](const McapMessage&) -> Status {
    if (++messages == 7) return Error{"enough"};
    return Done{};
  });
  ASSERT_FALSE(overview);
  EXPECT_EQ(overview.error().message, "enough");
  EXPECT_EQ(messages, 7);
}

constexpr const char* kRobot =
    R"({"joints": [{"name": "lift", "type": "prismatic"}, {"name": "elbow", "type": "revolute"},
                   {"name": "wrist", "type": "revolute"}], "velocity_max": [1, 2, 3], "acceleration_max": [4, 5, 6]})";

TEST(SessionFile, ReadsBackWhatTheRecorderWrote) {
  const auto path = test::temporary_file("session.mcap");
  std::mt19937 random(7);
  RecorderSettings settings;
  settings.names = test::names();
  settings.live = true;
  settings.run = {{"profile", "waiter"}};
  Result<Recorder> recorder = Recorder::create(path, settings);
  ASSERT_TRUE(recorder);
  ASSERT_TRUE(recorder->add_metadata("robot", {{"json", kRobot}}));
  std::vector<PlanStep> steps;
  std::vector<JointCommand> commands;
  OperatorSample sample;
  sample.stamp = {Time(-5), Time(7)};  // a hand that moved before the session began
  sample.X_operator_hand.p = {0.1, std::numeric_limits<double>::quiet_NaN(), 1.0 / 3.0};
  sample.clutch = true;
  ASSERT_TRUE(recorder->write(sample));
  for (int i = 0; i < 50; ++i) {
    steps.push_back(test::random_step(random));
    ASSERT_TRUE(recorder->write(steps.back()));
    const Time t = std::chrono::milliseconds(2 * i);
    commands.push_back({{t, t}, steps.back().q, steps.back().dq, steps.back().ddq});
    ASSERT_TRUE(recorder->write(commands.back()));
    ASSERT_TRUE(recorder->write(JointState{{t, t}, steps.back().q, steps.back().dq}));
  }
  ASSERT_TRUE(recorder->write(SupervisionChange{std::chrono::seconds(1), SupervisionState::kEngaged,
                                                SupervisionState::kFault, "a \"reason\"", true, ReasonCode::kOffPath}));
  ASSERT_TRUE(recorder->close());

  SessionParts parts;
  parts.samples = parts.steps = parts.commands = parts.states = parts.changes = true;
  parts.state_period = 0.01;
  const auto session = load_session(path, parts);
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->run("profile"), "waiter");
  EXPECT_EQ(session->names.joints, test::names().joints);
  EXPECT_EQ(session->names.joint_units, test::names().joint_units);
  EXPECT_EQ(session->acceleration_max, JointVector(Eigen::Vector3d(4, 5, 6)));
  ASSERT_EQ(session->samples.size(), 1u);
  EXPECT_EQ(session->samples[0].stamp.hand, Time(-5));
  EXPECT_TRUE(std::isnan(session->samples[0].X_operator_hand.p.y()));
  EXPECT_EQ(session->samples[0].X_operator_hand.p.z(), 1.0 / 3.0);
  ASSERT_EQ(session->steps.size(), steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    EXPECT_NEAR(session->steps[i].t_s, steps[i].t_s, 1e-9);
    EXPECT_EQ(session->steps[i].q, steps[i].q);
    EXPECT_EQ(session->steps[i].tools[0].X_base_planned.q.coeffs(), steps[i].tools[0].X_base_planned.q.coeffs());
    EXPECT_EQ(session->steps[i].status, steps[i].status);
    EXPECT_EQ(session->commands[i].ddq, commands[i].ddq);
  }
  EXPECT_EQ(session->states.size(), 10u);
  ASSERT_EQ(session->changes.size(), 1u);
  EXPECT_EQ(session->changes[0].to, "fault");
  EXPECT_EQ(session->changes[0].reason, "a \"reason\"");
  EXPECT_EQ(session->changes[0].code, ReasonCode::kOffPath);

  const auto listed = list_sessions(path.parent_path());
  EXPECT_TRUE(std::any_of(listed.begin(), listed.end(),
                          [](const SessionEntry& e) { return e.name == "session" && e.complete && e.bytes > 0; }));
}

TEST(SessionFile, TakesTheCodeOfOldChangesFromTheirWords) {
  const auto path = test::temporary_file("old_changes.mcap");
  Result<McapWriter> writer = McapWriter::create(path, {});
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(writer->add_metadata("robot", {{"json", kRobot}}));
  const auto channel = writer->add_channel({"/supervision", "steadyhand.Supervision", "{}", {}});
  for (const std::string reason : {"the planner is late", "the control loop stalled", "released"}) {
    const std::string time = R"({"timestamp":{"sec":1,"nsec":0},"from":"engaged","to":"ready","reason":")";
    ASSERT_TRUE(writer->write(channel, Time(1), Time(1), time + reason + "\"}"));
  }
  ASSERT_TRUE(writer->close());
  SessionParts parts;
  parts.changes = true;
  const auto session = load_session(path, parts);
  ASSERT_TRUE(session) << session.error().message;
  ASSERT_EQ(session->changes.size(), 3u);
  EXPECT_EQ(session->changes[0].code, ReasonCode::kPlannerLate);
  EXPECT_EQ(session->changes[1].code, ReasonCode::kStalled);
  EXPECT_EQ(session->changes[2].code, std::nullopt);
}

TEST(SessionFile, AreListedFromTheNewestOnWhateverTheyAreCalled) {
  const TemporaryFolder folder;
  const auto add = [&](const std::string& name, const std::map<std::string, std::string>& run) {
    Result<McapWriter> writer = McapWriter::create(folder.path() / (name + ".mcap"), {});
    ASSERT_TRUE(writer) << writer.error().message;
    EXPECT_TRUE(writer->add_metadata("run", run));
    EXPECT_TRUE(writer->close());
  };
  add("2026-11-26_08-00-00", {});
  add("an old one", {{"started", "2026-11-26_07-00-00 UTC"}});
  add("of a long program", {{"started", "2026-11-26_06-00-00 UTC"}, {"recorded", "2026-11-26_09-00-00 UTC"}});
  add("2026-11-26_05-00-00_2", {{"started", "2026-11-26_05-00-00 UTC"}, {"recorded", "2026-11-26_07-30-00 UTC"}});
  add("tells nothing", {});
  const auto years_ago = std::filesystem::file_time_type::clock::now() - std::chrono::hours(24 * 365 * 40);
  std::filesystem::last_write_time(folder.path() / "tells nothing.mcap", years_ago);
  std::vector<std::string> names;
  for (const SessionEntry& entry : list_sessions(folder.path())) names.push_back(entry.name);
  EXPECT_EQ(names, (std::vector<std::string>{"of a long program", "2026-11-26_08-00-00", "2026-11-26_05-00-00_2",
                                             "an old one", "tells nothing"}));
}

TEST(SessionFile, RefusesWhatDoesNotFit) {
  const auto path = test::temporary_file("foreign.mcap");
  (void)written(path);
  const auto foreign = load_session(path, {});
  ASSERT_FALSE(foreign);
  EXPECT_NE(foreign.error().message.find("robot"), std::string::npos) << foreign.error().message;

  for (const char* message :
       {"{}", "[", "{\"timestamp\":{\"sec\":0,\"nsec\":0},\"q\":3,\"dq\":[],\"ddq\":[]}",
        "{\"q\":[1,2,3,4,5,6,7,8,9],\"dq\":[],\"ddq\":[]}", "{\"q\":[1],\"dq\":[1],\"ddq\":[1]}"}) {
    Result<McapWriter> writer = McapWriter::create(path);
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->add_metadata("robot", {{"json", kRobot}}));
    const auto channel = writer->add_channel({"/joint_command", "S", "{}", {}});
    ASSERT_TRUE(writer->write(channel, Time(1), Time(1), message));
    ASSERT_TRUE(writer->close());
    SessionParts parts;
    parts.commands = true;
    EXPECT_FALSE(load_session(path, parts)) << message;
  }
}

}  // namespace
}  // namespace steadyhand
