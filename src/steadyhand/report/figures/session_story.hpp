#pragma once

#include <string>
#include <vector>

#include "steadyhand/files/record/session_file.hpp"
#include "steadyhand/report/figures/report.hpp"

namespace steadyhand {

/// %, of a share of the liquid: "3.6", "100", "less than 0.1"; rounded like the operator's page (web/src/figures.ts).
std::string percent_text(double share);

/// "spilled 100 % of the liquid within 0.9 s".
std::string spill_text(const SessionStory::Spill& spill);

/// Readable name of a body or a joint: "forearm" for forearm_5, "wrist 3" for wrist_3_joint; same as on the operator's
/// page (web/src/figures.ts).
std::string part_text(const std::string& name);
/// part_text() for each joint. Where two texts would be equal, those joints keep their names.
std::vector<std::string> part_texts(const std::vector<std::string>& names);

/// Readable name of a term of the objective, as in the documentation: "acceleration step" for acceleration_step.
std::string term_text(const std::string& name);
/// "0.4", or "1 1 2" if they differ. @pre not empty
std::string weight_text(const std::vector<double>& values);

/// States, stops, spills, limits, settings, missed deadlines and gaps of a session, and its latency over time.
SessionStory tell_story(const SessionFile& session);

/// The measured lateral specific forces at a tool while engaged: report and comparison are a mean of these.
std::vector<SessionFile::Felt> felt_while_led(const SessionFile& session, int tool);

/// Assigns the session's steps and commands to the settings in force when they were made: one result for each profile,
/// scale, tilt and weights in use, in the order in which they came. If there are more than eight, the briefest are
/// merged into one. One result if no settings were recorded (older sessions). @pre session.steps is not empty
std::vector<ProfileResult> split_by_settings(SessionFile session);

}  // namespace steadyhand
