#pragma once

#include <filesystem>

#include "steadyhand/files/input/recording.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "steadyhand/report/figures/report.hpp"
#include "steadyhand/session/supervise/hand_gate.hpp"

namespace steadyhand {

/// What the gate of a live session would make of a recorded hand: samples that it would drop go, and where a pose could
/// not be trusted the clutch is open. @return how many poses were not good
std::size_t pass_gate(Recording& recording, const HandGateSettings& settings);

/// The operator's hand of a session that was recorded, as the live gate let it through: samples that were dropped are
/// not in it, and those whose pose could not be trusted have an open clutch. Fails as load_session, on a range that is
/// none, and if fewer than 2 samples are left.
struct SessionHand {
  Recording recording;
  std::vector<SettingsChange> changes;  ///< of the operator's settings, by the recording's time; some before its begin
  std::vector<CellChange> cells;        ///< what stood around the arm, likewise
};
Result<SessionHand> hand_of_session(const SessionFile& session, const RecordingOptions& range,
                                    const HandGateSettings& gate);

/// s, between two looks at a session that are shown: 30 times a second, 54,000 of them at most. One for replay and
/// report, whose figures are made of them.
double look_period(const McapOverview& overview);

/// What replay and report are made of.
SessionParts replayed_parts(const McapOverview& overview);

/// The report of what was driven. Fails if no plan was.
Result<ReportInput> report_of_session(SessionFile session, const std::string& command);

/// Reads a session for its report. Fails as load_session and report_of_session.
Result<ReportInput> load_session_report(const std::filesystem::path& session);

}  // namespace steadyhand
