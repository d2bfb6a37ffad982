#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/record/cell_change.hpp"
#include "steadyhand/files/record/mcap_reader.hpp"
#include "steadyhand/files/record/messages.hpp"
#include "steadyhand/files/record/spill_watch.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"

namespace steadyhand {

/// Which messages of a session are wanted.
struct SessionParts {
  bool samples = false, steps = false, commands = false;
  /// Of more commands neighbours are merged, so that a session of hours takes no more memory than one of a minute.
  std::size_t most_commands = std::numeric_limits<std::size_t>::max();
  bool states = false;              ///< measured states,
  bool liquid = false;              ///< and what the liquid did,
  double state_period = 0.0;        ///< s, at least so far apart
  double felt_period = 1.0 / 30.0;  ///< s, of each entry of `felt`
  bool changes = false;
  bool settings = false;
  bool cells = false;       ///< obstacles around the arm
  bool limits = false;      ///< what held the arm back
  bool statistics = false;  ///< what was counted
  bool episodes = false;    ///< what was said of episodes, and the states of a simulated scene
};

/// Data that Recorder has written, read back. Times count from the session's begin.
struct SessionFile {
  using Change = StateChange;
  using Limit = LimitChange;

  /// The lateral specific force on the liquid, m/s^2, from `at` until the next: measured, not planned.
  struct Felt {
    Time at{0};
    double sum = 0.0, largest = 0.0;
    int count = 0;
    double mean() const { return sum / count; }
  };

  /// The surface from `at` on until the next, as far apart as `felt`.
  struct Wave {
    Time at{0};
    double freeboard = 0.0;      ///< m, the least: LiquidState
    double spilled_share = 0.0;  ///< the largest
  };

  /// The liquid in the glass of a tool; empty if the session does not know it.
  struct Liquid {
    std::vector<std::pair<Time, LiquidState>> states;
    std::vector<Felt> felt;  ///< none in sessions of before it was recorded
    std::vector<Wave> waves;
    SpillLog spills;  ///< from all recorded states
  };

  std::string name;  ///< the file's, without its extension
  McapOverview overview;
  RunNames names;                              ///< terms: as the first step has them; none without steps
  JointVector velocity_max, acceleration_max;  ///< rad/s, rad/s^2 (m...)
  std::vector<OperatorSample> samples;
  std::vector<PlanStep> steps;
  std::vector<JointCommand> commands;
  int commands_merged = 1;  ///< in each except the last: time of the first, largest |dq| and |ddq|
  std::vector<JointState> states;
  std::vector<Change> changes;
  std::vector<Limit> limits;
  PerTool<Liquid> liquids;  ///< of each
  std::vector<SessionStatistics> statistics;
  std::vector<EpisodeMark> episodes;
  std::vector<SceneLook> scenes;
  std::vector<CellChange> cells;         ///< obstacles around the arm; none in sessions older than this channel
  std::vector<SettingsChange> settings;  ///< what the operator set; none in sessions of before there was that

  /// An entry of the metadata `run`; empty if it is not there.
  std::string run(const std::string& key) const;
  double duration() const { return to_seconds(overview.last - overview.first); }  ///< s
};

/// Reads the recording of a live session or a replay, even if it was cut short. Refuses files as read_mcap does, files
/// of other programs, and messages that do not fit.
Result<SessionFile> load_session(const std::filesystem::path& path, const SessionParts& parts);

/// One session in a folder, without its messages.
struct SessionEntry {
  std::filesystem::path path;
  std::string name;
  bool complete = false;
  double duration = 0.0;  ///< s
  std::uintmax_t bytes = 0;
  std::map<std::string, std::string> run, summary;  ///< its metadata; no summary if it was cut short
  std::string fault;  ///< why the arm stopped, if these are the seconds before a fault; empty: a session
};

/// The sessions of a folder, from the one that began last. Files that cannot be read are left out; a folder that is not
/// there has none.
std::vector<SessionEntry> list_sessions(const std::filesystem::path& folder);

}  // namespace steadyhand
