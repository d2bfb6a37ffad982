#pragma once

#include <filesystem>

#include "steadyhand/files/input/recording.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "steadyhand/report/figures/report.hpp"
#include "steadyhand/session/supervise/hand_gate.hpp"

namespace steadyhand {

/// Applies the gate of a live session to a recorded hand: removes samples that it would drop, and opens the clutch
/// where a pose cannot be trusted. @return how many poses were not good
std::size_t pass_gate(Recording& recording, const HandGateSettings& settings);

/// The operator's hand of a recorded session after the live gate: dropped samples are absent, and samples whose pose
/// could not be trusted have an open clutch. Fails as load_session does, on an invalid range, and if fewer than 2
/// samples are left.
struct SessionHand {
  Recording recording;
  std::vector<SettingsChange> changes;  ///< operator's settings, by the recording's time; some before its start
  std::vector<CellChange> cells;        ///< obstacles, likewise
};
Result<SessionHand> hand_of_session(const SessionFile& session, const RecordingOptions& range,
                                    const HandGateSettings& gate);

/// s, between two moments of a session that are shown: 30 a second, 54,000 at most. Replay and report use the same,
/// since their figures depend on it.
double look_period(const McapOverview& overview);

/// The parts of a session that replay and report read.
SessionParts replayed_parts(const McapOverview& overview);

/// The report of a recorded session. Fails if it has no plan.
Result<ReportInput> report_of_session(SessionFile session, const std::string& command);

/// Reads a session for its report. Fails as load_session and report_of_session do.
Result<ReportInput> load_session_report(const std::filesystem::path& session);

}  // namespace steadyhand
