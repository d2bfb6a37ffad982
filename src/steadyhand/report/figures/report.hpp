#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/record/step.hpp"
#include "steadyhand/report/figures/metrics.hpp"

namespace steadyhand {

/// One profile's run over the recording.
struct ProfileResult {
  std::string name;   ///< as on the command line, e.g. "anti-slosh"
  std::string label;  ///< what to call it in tables and plots, e.g. "P2 anti-slosh"
  Weights weights;    ///< none: not known, or not the same throughout
  RunNames names;
  JointLimits limits;
  std::vector<PlanStep> steps;
  std::vector<JointCommand> commands;  ///< sent by the tracker; may be empty
  int commands_merged = 1;             ///< commands that each entry merges, by the largest |dq| and |ddq|
  // ---- of a live session, while engaged
  double led_s = 0;  ///< with any hand
  struct Liquid {
    std::vector<Felt> felt{};  ///< measured lateral specific force; empty: not recorded
    int spills = -1;           ///< how often the liquid went over the rim; -1: not known
    double spilled_share = 0;  ///< share of the liquid, largest of all spills
  };
  PerTool<Liquid> liquids{};  ///< of each tool
};

/// Events of a live session in addition to its plans; empty for a replay.
struct SessionStory {
  struct Event {
    double t_s = 0;
    std::string kind;   ///< "state", "spill", "refill", "limit", "setting", "missed", "gap" or "rest"
    std::string what;   ///< name of a state, otherwise a text
    std::string why;    ///< may be empty
    double amount = 0;  ///< spill: share of the liquid; missed deadlines: their number
  };
  struct Latency {
    double t_s = 0, p50_ms = 0, p99_ms = 0;  ///< hand to command
  };
  /// One spill: the liquid went over the rim.
  struct Spill {
    double t_s = 0;
    double share = 0;    ///< share of the liquid
    double lateral = 0;  ///< m/s^2, largest lateral specific force in the half second before; 0: not recorded
    std::string cause;   ///< in words
    std::optional<double> full_again_s{};  ///< absent: not in this session
    double within_s = 0;                   ///< duration of the spill
    int tool = 0;                          ///< that held the glass
  };
  double begin_s = 0, end_s = 0;  ///< first and last time of the recording
  bool has_glass = true;          ///< false with grippers only
  bool knows_liquid = false;      ///< there was a glass, and its liquid was recorded
  std::vector<Spill> spills;
  double led_s = 0;           ///< engaged time
  std::vector<Event> events;  ///< in the order of their times
  std::vector<Latency> latency;
  std::string robot;  ///< JSON as `steadyhand describe` prints it
};

struct ReportInput {
  std::string recording;  ///< its name
  std::string title;      ///< what people call it; empty: its name
  std::string recorded;   ///< when, in the format of recordings' names; empty: not known
  double rate_hz = 0;     ///< rate of planning
  double scale = 1;       ///< scale of the hand's translation
  std::string scales;     ///< all scales in use while engaged, if there were several
  std::string command;    ///< what to type to get this report again
  std::vector<ProfileResult> profiles;
  std::optional<SessionStory> story;  ///< only of a live session
  std::string motion;                 ///< motion_json; only of a live session
  double begin_s = 0;                 ///< start of `motion`: all other times count from here
  std::vector<std::string> lost;      ///< damaged parts of its file
};

/// One self-contained HTML page: web/report.html with report_data in it. Equal input gives equal bytes. Fails if there
/// is no profile or a profile has no steps.
Result<std::string> report_page(const ReportInput& input);
/// Writes that page; fails also if the file cannot be written.
Status write_report(const ReportInput& input, const std::filesystem::path& path);

/// As evaluate(), with measured lateral specific forces where they were recorded.
Metrics metrics_of(const ProfileResult& profile);

/// The metrics as text for a terminal: a row per metric, a column per profile, at most 100 columns wide for up to four
/// profiles. Ends with a line end. @pre as evaluate(), for each profile
std::string format_table(const std::vector<ProfileResult>& profiles);

}  // namespace steadyhand
