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
  std::vector<JointCommand> commands;  ///< what the tracker sent; may be empty
  int commands_merged = 1;             ///< of them that each stands for, by the largest |dq| and |ddq|
  // ---- of a live session, while the hand led
  std::vector<Felt> felt{};  ///< the sideways acceleration as it was measured; empty: not recorded
  double led_s = 0;
  int spills = -1;           ///< how often the liquid went over the rim; -1: not known
  double spilled_share = 0;  ///< of the liquid, most of these times
};

/// What happened in a live session beside its plans; empty of a replay.
struct SessionStory {
  struct Event {
    double t_s = 0;
    std::string kind;   ///< "state", "spill", "refill", "limit", "setting", "missed", "gap" or "rest"
    std::string what;   ///< of a state its name, otherwise in words
    std::string why;    ///< may be empty
    double amount = 0;  ///< of a spill: the share of the liquid; of missed deadlines: how many
  };
  struct Latency {
    double t_s = 0, p50_ms = 0, p99_ms = 0;  ///< hand to command
  };
  /// A time at which the liquid went over the rim.
  struct Spill {
    double t_s = 0;
    double share = 0;                      ///< of the liquid
    double lateral = 0;                    ///< m/s^2, largest sideways force in the half second before; 0: not recorded
    std::string cause;                     ///< in words
    std::optional<double> full_again_s{};  ///< absent: not in this session
    double within_s = 0;                   ///< that it took
  };
  double begin_s = 0, end_s = 0;  ///< of the recording
  bool has_glass = true;          ///< a gripper has none
  bool knows_liquid = false;      ///< there was a glass whose liquid was recorded
  std::vector<Spill> spills;
  double led_s = 0;           ///< in which the hand led
  std::vector<Event> events;  ///< in the order of their times
  std::vector<Latency> latency;
  std::string robot;  ///< JSON as `steadyhand describe` prints it
};

struct ReportInput {
  std::string recording;  ///< its name
  std::string title;      ///< what people call it; empty: its name
  std::string recorded;   ///< when, as in a name that was made then; empty: not known
  double rate_hz = 0;     ///< re-planning
  double scale = 1;       ///< of the hand's translation
  std::string scales;     ///< all that led, where there were several
  std::string command;    ///< what to type to get this report again
  std::vector<ProfileResult> profiles;
  std::optional<SessionStory> story;  ///< of a live session
  std::string motion;                 ///< of a live session: motion_json
  double begin_s = 0;                 ///< of what is in `motion`: all other times count from here
  std::vector<std::string> lost;      ///< damaged parts of its file
};

/// One HTML page that needs nothing else: the page of web/report.html with report_data in it. Equal input gives equal
/// bytes. Fails if there is no profile or a profile has no steps.
Result<std::string> report_page(const ReportInput& input);
/// Writes that page; fails also if the file cannot be written.
Status write_report(const ReportInput& input, const std::filesystem::path& path);

/// As evaluate(), and what was felt, where that was recorded.
Metrics metrics_of(const ProfileResult& profile);

/// The metrics as text for a terminal: a row per metric, a column per profile, at most 100 columns wide for up to four
/// profiles. Ends with a line end. @pre as evaluate(), for each profile
std::string format_table(const std::vector<ProfileResult>& profiles);

}  // namespace steadyhand
