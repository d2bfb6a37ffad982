#include <fmt/format.h>

#include "steadyhand/files/record/episode_mark.hpp"
#include "support/recorded.hpp"

namespace steadyhand {
namespace {

/// A place whose disk is full once a recording has a number of bytes.
struct FullDisk final : RecordingPlace {
  struct Sink final : McapSink {
    explicit Sink(std::size_t room_) : room(room_) {}
    std::string name() const override { return "full"; }
    Status put(std::string_view bytes) override {
      if (bytes.size() > room) return Error{"No space left on device"};
      room -= bytes.size();
      return Done{};
    }
    std::size_t room;
  };
  explicit FullDisk(std::size_t room_) : room(room_) {}
  Result<Opened> open(const std::function<std::string(int)>& numbered) override {
    return Opened{numbered(1), numbered(1), std::make_unique<Sink>(room)};
  }
  std::size_t room;
};

EpisodeMark said(EpisodeMark::Kind kind, int episode, Time at) {
  EpisodeMark mark;
  mark.kind = kind;
  mark.episode = episode;
  mark.at = at;
  return mark;
}

/// In the order in which they become known.
std::string outcomes(SessionRecorder& recorder) {
  std::string text;
  for (const EpisodeOutcome& outcome : recorder.take_episode_outcomes()) {
    text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", to_string(outcome.kind), outcome.episode,
                        outcome.recorded ? "" : " not");
  }
  return text;
}

using Said = EpisodeMark::Kind;

TEST_F(Recorded, WhatIsSaidOfAnEpisodeIsInItsFile) {
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  run(taps, 0.1);
  ASSERT_TRUE(recorder.mark(said(Said::kBegin, 1, now)));
  run(taps, 0.1);
  EXPECT_EQ(outcomes(recorder), "begin 1");
  ASSERT_TRUE(recorder.mark(said(Said::kKeep, 1, now)));
  recorder.ask(false);  // what was said before belongs in it
  run(taps, to_seconds(SessionRecorder::kShortestFile));
  EXPECT_EQ(outcomes(recorder), "keep 1");
  recorder.ask(true);
  run(taps, 0.1);
  const Status late = recorder.mark(said(Said::kDiscard, 1, now));
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().message, "the recording of episode 1 has ended; what it says of the episode stays");
  recorder.finish({});
  ASSERT_EQ(files().size(), 2u);
  SessionParts parts;
  parts.episodes = true;
  EXPECT_EQ(load_session(files()[0], parts)->episodes.size(), 2u);
  EXPECT_EQ(load_session(files()[1], parts)->episodes.size(), 0u);
}

TEST_F(Recorded, AnEpisodeWhoseRecordingEndsIsNotRecorded) {
  SessionRecorder recorder = make();
  LiveTaps taps = recorder.taps();
  const auto begin_one = [&](int episode) {
    ASSERT_TRUE(recorder.mark(said(Said::kBegin, episode, now)));
    run(taps, 2.5);
    EXPECT_EQ(outcomes(recorder), fmt::format("begin {}", episode));
  };
  run(taps, 0.1);
  begin_one(1);
  recorder.ask(false);
  run(taps, 0.1);
  EXPECT_EQ(outcomes(recorder), "begin 1 not");
  recorder.ask(true);
  run(taps, 0.1);
  EXPECT_FALSE(recorder.mark(said(Said::kKeep, 1, now)));

  begin_one(2);
  fs::remove(files().at(1));
  ASSERT_TRUE(recorder.mark(said(Said::kKeep, 2, now)));  // before anything else sees that it has gone
  run(taps, 0.02);
  EXPECT_EQ(outcomes(recorder), "begin 2 not, keep 2 not");

  begin_one(3);
  fs::remove(files().at(1));
  run(taps, 1.5);  // which is seen after a while anyway
  EXPECT_EQ(outcomes(recorder), "begin 3 not");

  begin_one(4);
  recorder.finish({});
  EXPECT_EQ(outcomes(recorder), "begin 4 not");
}

/// Up to the mark itself, and not only as far as a chunk was written.
TEST_F(Recorded, AnEpisodeIsKeptWhenTheDiskHasTakenIt) {
  std::size_t kept = 0, lost = 0;
  for (std::size_t room = 20'000; room < 60'000; room += 2'000) {
    SessionRecorder recorder(ocp, settings, {{"run", {}}}, begin, std::make_unique<FullDisk>(room));
    LiveTaps taps = recorder.taps();
    now = begin;
    run(taps, 0.02);
    if (!recorder.mark(said(Said::kBegin, 1, now))) continue;
    run(taps, 0.07);  // less than a chunk
    const bool taken = bool(recorder.mark(said(Said::kKeep, 1, now)));
    run(taps, 0.02);
    const std::string what = outcomes(recorder);
    if (what == "begin 1, keep 1") {
      ++kept;
      EXPECT_TRUE(recorder.recording());
    } else {
      ++lost;
      EXPECT_TRUE(what == "begin 1, begin 1 not, keep 1 not" || (!taken && what == "begin 1, begin 1 not")) << what;
      EXPECT_FALSE(recorder.recording());
    }
  }
  EXPECT_GT(kept, 0u);
  EXPECT_GT(lost, 0u);
}

}  // namespace
}  // namespace steadyhand
