#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/record/step.hpp"
#include "steadyhand/report/metrics.hpp"

namespace steadyhand {

/// One profile's run over the recording.
struct ProfileResult {
  std::string name;     ///< as on the command line, e.g. "anti-slosh"
  std::string label;    ///< what to call it in tables and plots, e.g. "P2 anti-slosh"
  std::string weights;  ///< its weights in a line of text
  RunNames names;
  JointLimits limits;
  std::vector<PlanStep> steps;
  std::vector<JointCommand> commands;  ///< what the tracker sent; may be empty
  int commands_merged = 1;             ///< of them that each stands for, by the largest |dq| and |ddq|
};

struct ReportInput {
  std::string recording;  ///< its name
  double rate_hz = 0;     ///< re-planning
  double scale = 1;       ///< of the hand's translation
  std::string command;    ///< what to type to get this report again
  std::vector<ProfileResult> profiles;
};

/// One HTML page that needs nothing else: metrics, the paper's plots, planner and limits, for all profiles side by
/// side. Equal input gives equal bytes. Fails if there is no profile or a profile has no steps.
Result<std::string> report_page(const ReportInput& input);
/// Writes that page; fails also if the file cannot be written.
Status write_report(const ReportInput& input, const std::filesystem::path& path);

/// The metrics as text for a terminal: a row per metric, a column per profile, at most 100 columns wide for up to four
/// profiles. Ends with a line end. @pre as evaluate(), for each profile
std::string format_table(const std::vector<ProfileResult>& profiles);

}  // namespace steadyhand
