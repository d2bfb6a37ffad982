#pragma once

#include <string>
#include <vector>

#include "steadyhand/files/record/session_file.hpp"
#include "steadyhand/report/figures/report.hpp"

namespace steadyhand {

/// %, of a share of the liquid: "3.6", "100", "less than 0.1"; as the operator's page rounds it (web/src/figures.ts).
std::string percent_text(double share);

/// "spilled 100 % of the liquid within 0.9 s".
std::string spill_text(const SessionStory::Spill& spill);

/// A body or a joint as people call it: "forearm" of forearm_5, "wrist 3" of wrist_3_joint; as the operator's page says
/// it (web/src/figures.ts).
std::string part_text(const std::string& name);
/// Of each joint. What two would share says nothing: those keep their names.
std::vector<std::string> part_texts(const std::vector<std::string>& names);

/// A term of the objective, as the documentation calls it, in words: "acceleration step" of acceleration_step.
std::string term_text(const std::string& name);
/// "0.4", or "1 1 2" where they differ. @pre there are some
std::string weight_text(const std::vector<double>& values);

/// States, stops, spills, limits, settings, missed deadlines and gaps of a session, and its latency over time.
SessionStory tell_story(const SessionFile& session);

/// Of what was felt, that which began while the hand led: what report and comparison are a mean of.
std::vector<SessionFile::Felt> felt_while_led(const SessionFile& session);

/// The session's steps and commands booked on what was in force when they were made: a result for each profile with
/// each scale, tilt and weights that it was driven with, in the order in which they came; of more than eight the
/// briefest are one. Where nobody recorded settings (of sessions before there was that), one result. @pre session.steps
/// is not empty
std::vector<ProfileResult> split_by_settings(SessionFile session);

}  // namespace steadyhand
