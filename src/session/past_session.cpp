#include "session/past_session.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "session/planning_stage.hpp"

namespace steadyhand {

namespace {

double number_or(const std::string& text, double otherwise) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end != text.c_str() && *end == '\0' && std::isfinite(value) ? value : otherwise;
}

}  // namespace

Result<SessionHand> hand_of_session(const SessionFile& session, const RecordingOptions& range,
                                    const HandGateSettings& settings) {
  if (!(range.from >= 0.0) || !(range.until > range.from)) {
    return Error{fmt::format("the range is from {} s to {} s; it must start at 0 s or later and end after its start",
                             range.from, range.until)};
  }
  Recording recording;
  recording.name = session.name;
  HandGate gate(settings);
  Time begin{0}, heard{0}, last{0};
  for (OperatorSample sample : session.samples) {
    if (recording.samples.empty() && heard == Time(0)) begin = last = sample.stamp.made;
    const Time now = sample.stamp.made;
    if (to_seconds(now - heard) > PlanningSettings::kSilence) gate.forget();
    heard = now;
    const HandVerdict verdict = gate.update(sample, now);
    const bool dropped = verdict == HandVerdict::kOutOfOrder || verdict == HandVerdict::kStale ||
                         verdict == HandVerdict::kClockStepped || !sample.X_operator_hand.p.allFinite() ||
                         !sample.X_operator_hand.q.coeffs().allFinite();
    const double t = to_seconds(now - begin);
    if (dropped || t < range.from || t > range.until) continue;
    if (!recording.samples.empty() && sample.stamp.hand <= last) continue;
    last = sample.stamp.hand;
    sample.clutch = sample.clutch && verdict == HandVerdict::kGood;
    sample.tracked = true;
    recording.samples.push_back(sample);
  }
  if (recording.samples.size() < 2) {
    return Error{fmt::format("{}: {} of the hand's {} samples can be replayed; at least 2 must", session.name,
                             recording.samples.size(), session.samples.size())};
  }
  const Time first = recording.samples.front().stamp.hand;
  std::vector<SettingsChange> changes = session.settings;
  for (SettingsChange& change : changes) change.at -= first;
  for (OperatorSample& sample : recording.samples) {
    sample.stamp.hand -= first;
    sample.stamp.made = sample.stamp.hand;
  }
  return SessionHand{std::move(recording), std::move(changes)};
}

Result<ReportInput> report_of_session(SessionFile session, const std::string& command) {
  if (session.steps.empty()) {
    return Error{fmt::format("{}: nothing was planned in it, so there is nothing to report", session.name)};
  }
  ReportInput report;
  report.recording = session.name;
  report.rate_hz = number_or(session.run("rate_hz"), 20.0);
  report.scale = number_or(session.run("scale"), 1.0);
  report.command = command;
  const std::string profile = session.run("profile"), label = session.run("label");
  report.profiles.push_back({profile,
                             (label.empty() ? profile : label) + ", as driven",
                             session.run("weights"),
                             std::move(session.names),
                             {session.velocity_max, session.acceleration_max},
                             std::move(session.steps),
                             std::move(session.commands)});
  return report;
}

Result<ReportInput> load_session_report(const std::filesystem::path& path) {
  SessionParts parts;
  parts.steps = parts.commands = true;
  Result<SessionFile> session = load_session(path, parts);
  if (!session) return session.error();
  Result<ReportInput> report = report_of_session(*std::move(session), "./steadyhand report " + path.string());
  if (!report) return Error{path.string() + ": " + report.error().message};
  return report;
}

}  // namespace steadyhand
