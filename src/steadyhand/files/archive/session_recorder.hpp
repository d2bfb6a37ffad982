#pragma once

#include <atomic>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/mutex.hpp"
#include "steadyhand/files/archive/recording_place.hpp"
#include "steadyhand/files/record/cell_change.hpp"
#include "steadyhand/files/record/recorder.hpp"
#include "steadyhand/files/record/spill_watch.hpp"
#include "steadyhand/files/record/step_describer.hpp"
#include "steadyhand/session/live/live_session.hpp"

namespace steadyhand {

struct RecordingSettings {
  bool enabled = true;           ///< from the beginning; the operator may change it
  double plan_rate_hz = 20.0;    ///< plans and references written a second, at most; > 0
  double flight_seconds = 10.0;  ///< s before a fault that go to a separate file; 0: none
};

/// The newest values of a kind, in memory that is taken once.
template <typename T>
class History {
 public:
  explicit History(double capacity) : ring_(static_cast<std::size_t>(capacity) + 1) {}
  void push(const T& value) {
    ring_[next_] = value;
    next_ = (next_ + 1) % ring_.size();
    count_ = std::min(count_ + 1, ring_.size());
  }
  /// From the oldest.
  template <typename Use>
  void for_each(const Use& use) const {
    for (std::size_t i = 0; i < count_; ++i) use(ring_[(next_ + ring_.size() - count_ + i) % ring_.size()]);
  }

 private:
  std::vector<T> ring_;
  std::size_t next_ = 0, count_ = 0;
};

/// Writes a live session as MCAP while it runs, by the name DATE_TIME, and after each fault the last seconds before it,
/// DATE_TIME-fault-1. Times in the file count from the session's begin. If the file cannot be written
/// (any more), this is reported at once and ends the recording, never the session. The taps run on the session's writer
/// thread.
class SessionRecorder {
 public:
  using Metadata = std::map<std::string, std::map<std::string, std::string>>;
  static constexpr Time kShortestFile = std::chrono::seconds(2);

  /// @param metadata goes into every file; `run` and `robot` are what a report needs
  /// @param begin what counts as 0, session's clock. The Ocp must outlive it.
  SessionRecorder(const Ocp& ocp, const RecordingSettings& settings, Metadata metadata, Time begin,
                  std::unique_ptr<RecordingPlace> place, std::vector<CameraInfo> cameras = {});

  /// For Session::begin. It must outlive the session's threads.
  LiveTaps taps();

  // ---- any thread
  /// Begins a new file, or ends the one that is being written, soon.
  /// A file is at least kShortestFile long: if recording is asked for again until then, the file continues.
  void ask(bool record) { wanted_ = record; }
  bool recording() const { return recording_; }
  bool wanted() const { return wanted_; }  ///< what was asked for
  /// Name of the session that is written now, without folder and extension; empty: none.
  std::string writing() const;
  /// Notices for people: files started and ended, and failures. Each line once.
  std::vector<std::string> take_notices();

  /// What was said of an episode, by the session's clock, soon in the file that it began in. Fails if that has ended.
  Status mark(const EpisodeMark& mark);
  /// What became of each mark, and of episodes whose file ended within them. Each once. A mark counts as recorded when
  /// the operating system has taken everything up to it.
  std::vector<EpisodeOutcome> take_episode_outcomes();
  /// The same for a scene; looks that are not written yet may be dropped.
  void see(const SceneLook& look);

  /// A camera's frame, written soon; each file starts with a key frame. Frames that are not written yet may be dropped,
  /// and then all up to the next key frame, as they cannot be decoded.
  void film(VideoPacket packet);

  /// Completes the file; after the session has ended.
  void finish(const LiveSummary& summary);

 private:
  static constexpr int kMostFlights = 20;  ///< files of one session
  static constexpr std::size_t kMostLooks = 100;
  static constexpr std::size_t kMostPictures = 200;

  template <typename... Message>
  void write(const Message&... message);
  void check(const Status& written);
  template <typename Message>
  Message from_begin(Message message) const;
  void write_settings(const AppliedSettings& applied);
  void take_cell(Time at, const Cell& cell);
  void write_step(const PlanningRecord& record);
  void look(const SessionSnapshot& snapshot);
  void write_waiting();
  bool write_mark(EpisodeMark mark, int file);
  void report(const EpisodeOutcome& outcome);
  void lose_episode();
  void begin_file();
  void end_file();
  std::string profiles_that_led() const;
  std::map<std::string, std::string> spilled_and_led() const;
  void sum_up(const SessionSnapshot& now);
  Result<Recorder> create(std::unique_ptr<McapSink> sink) const;
  void write_flight();
  void notice(const std::string& line);

  RecordingSettings settings_;
  std::unique_ptr<RecordingPlace> place_;
  Metadata metadata_;
  RunNames names_;
  Time begin_;
  std::string stem_;  ///< common to the files' names
  StepDescriber describer_;

  std::optional<Recorder> file_;
  RecordingPlace::Opened opened_;  ///< the same; its sink is the file's
  int running_ = 0;                ///< number of the episode that runs in it; 0: none
  Time next_plan_{0}, next_statistics_{0};
  ActiveConstraint constraint_;
  std::optional<SettingsChange> operator_settings_;  ///< in force
  std::optional<Cell> cell_;                         ///< the same, as it was at `cell_at_` since the begin
  Time cell_at_{0};

  /// Data of the current file for the list of recordings; the session may continue after the file.
  struct Tally {
    Time begin{0}, last{0}, engaged{0};
    std::uint64_t missed_before = 0;
    std::map<std::string, double> led_by;  ///< s, by name of the profile
    PerTool<SpillLog> liquids;             ///< since the file began
  };
  Tally tally_;
  PerTool<bool> engaged_{};
  std::optional<Time> engaged_since_;  ///< any of them, or the last change; absent: none is

  struct Flight {
    Flight(double seconds, int tools);
    History<OperatorSample> samples;
    History<Target> targets;
    History<PlanStep> steps;
    History<JointCommand> commands;
    History<JointState> states;
    History<SupervisionChange> changes;
    History<LiquidMessage> liquid;
    std::deque<CellChange> cells;  ///< those of its time, and the one before
  };
  std::optional<Flight> flight_;
  std::optional<SupervisionChange> fault_;  ///< to be written
  std::optional<Time> failed_;              ///< time of the last failure
  int flights_ = 0;

  std::atomic<bool> wanted_, recording_{false};
  mutable Mutex mutex_;  ///< guards the notices, and opened_ for other threads
  std::vector<std::string> notices_;
  int files_ = 0;                                   ///< number of files so far, and of the newest
  int episode_file_ = 0;                            ///< number of that in which the newest episode began
  std::vector<std::pair<EpisodeMark, int>> marks_;  ///< to be written, as the next; each to the file of this number
  std::vector<EpisodeOutcome> outcomes_;
  std::vector<SceneLook> looks_;
  std::vector<VideoPacket> pictures_;
  std::vector<CameraInfo> cameras_;
  std::vector<bool> needs_key_;  ///< by camera: frames that waited before were dropped
  std::vector<bool> has_begun_;  ///< by camera, in this file; the writer's
};

}  // namespace steadyhand
