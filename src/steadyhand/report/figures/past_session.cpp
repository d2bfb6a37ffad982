#include "steadyhand/report/figures/past_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "steadyhand/report/figures/motion.hpp"
#include "steadyhand/report/figures/session_story.hpp"

namespace steadyhand {

namespace {

constexpr std::size_t kMostCommands = 60000;  ///< in a report: two minutes without merging
constexpr std::size_t kMostRows = 9000;       ///< rows that a report replays: five minutes at the page's rate

double number_or(const std::string& text, double otherwise) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end != text.c_str() && *end == '\0' && std::isfinite(value) ? value : otherwise;
}

/// The gate of a live session, applied to recorded hands.
class PastGate {
 public:
  explicit PastGate(const HandGateSettings& settings) : gate_(settings) {}
  /// False if the sample is dropped. Opens its clutch if its pose cannot be trusted.
  bool pass(OperatorSample& sample) {
    const Time now = sample.stamp.made;
    if (to_seconds(now - received_) > kSampleTimeout) gate_.forget();
    received_ = now;
    const HandVerdict verdict = gate_.update(sample, now);
    good_ = verdict == HandVerdict::kGood;
    sample.clutch = sample.clutch && good_;
    sample.tracked = true;
    return verdict != HandVerdict::kOutOfOrder && verdict != HandVerdict::kStale &&
           verdict != HandVerdict::kClockStepped && sample.X_operator_hand.p.allFinite() &&
           sample.X_operator_hand.q.coeffs().allFinite();
  }
  bool good() const { return good_; }

 private:
  HandGate gate_;
  Time received_{0};
  bool good_ = false;
};

/// One for each hand, by the tool that it moves.
std::vector<PastGate> gates_of_hands(const HandGateSettings& settings) {
  return std::vector<PastGate>(kMaxTools, PastGate(settings));
}

/// Times in the file are of the program's clock; people count from the arm's first posture, as a replay does.
double begin_of(const SessionFile& session) {
  const auto first = std::ranges::find_if(session.states, [](const JointState& state) { return state.q.allFinite(); });
  return to_seconds(first == session.states.end() ? session.overview.first : first->stamp.made);
}

void count_from_begin(ReportInput& report) {
  SessionStory& story = *report.story;
  const auto rebase = [begin = report.begin_s](double& t) { t = std::max(0.0, t - begin); };
  rebase(story.begin_s);
  rebase(story.end_s);
  for (SessionStory::Event& event : story.events) rebase(event.t_s);
  for (SessionStory::Spill& spill : story.spills) {
    rebase(spill.t_s);
    if (spill.full_again_s) rebase(*spill.full_again_s);
  }
  for (SessionStory::Latency& latency : story.latency) rebase(latency.t_s);
  for (ProfileResult& profile : report.profiles) {
    for (PlanStep& step : profile.steps) rebase(step.t_s);
    for (JointCommand& command : profile.commands) command.stamp.made -= from_seconds(report.begin_s);
  }
}

}  // namespace

std::size_t pass_gate(Recording& recording, const HandGateSettings& settings) {
  std::vector<PastGate> gates = gates_of_hands(settings);
  std::size_t bad = 0;
  std::vector<OperatorSample> passed;
  for (OperatorSample sample : recording.samples) {
    PastGate& gate = gates.at(static_cast<std::size_t>(sample.tool));
    if (gate.pass(sample)) passed.push_back(sample);
    bad += !gate.good();
  }
  recording.samples = std::move(passed);
  return bad;
}

Result<SessionHand> hand_of_session(const SessionFile& session, const RecordingOptions& range,
                                    const HandGateSettings& settings) {
  if (!(range.from >= 0.0) || !(range.until > range.from)) {
    return Error{fmt::format("the range is from {} s to {} s; it must start at 0 s or later and end after its start",
                             range.from, range.until)};
  }
  Recording recording;
  recording.name = session.name;
  std::vector<PastGate> gates = gates_of_hands(settings);
  PerTool<Time> last;
  last.fill(Time::min());
  Time begin{0};
  bool first_sample = true;
  for (OperatorSample sample : session.samples) {
    const Time now = sample.stamp.made;
    if (std::exchange(first_sample, false)) begin = now;
    const bool dropped = !gates.at(static_cast<std::size_t>(sample.tool)).pass(sample);
    const double t = to_seconds(now - begin);
    if (dropped || t < range.from || t > range.until) continue;
    if (sample.stamp.hand <= last[sample.tool]) continue;
    last[sample.tool] = sample.stamp.hand;
    recording.samples.push_back(sample);
  }
  if (recording.samples.size() < 2) {
    return Error{fmt::format("{}: {} of the hand's {} samples can be replayed; at least 2 must", session.name,
                             recording.samples.size(), session.samples.size())};
  }
  std::ranges::stable_sort(recording.samples, {}, [](const OperatorSample& sample) { return sample.stamp.hand; });
  const Time first = recording.samples.front().stamp.hand;
  std::vector<SettingsChange> changes = session.settings;
  for (SettingsChange& change : changes) change.at -= first;
  std::vector<CellChange> cells = session.cells;
  for (CellChange& change : cells) change.at -= first;
  for (OperatorSample& sample : recording.samples) {
    sample.stamp.hand -= first;
    sample.stamp.made = sample.stamp.hand;
  }
  return SessionHand{std::move(recording), std::move(changes), std::move(cells)};
}

double look_period(const McapOverview& overview) {
  constexpr double kPeriod = 1.0 / 30.0, kMost = 54000.0;  // s; half an hour
  return std::max(kPeriod, to_seconds(overview.last - overview.first) / kMost);
}

SessionParts replayed_parts(const McapOverview& overview) {
  SessionParts parts;
  parts.states = parts.steps = parts.liquid = parts.changes = parts.settings = true;
  parts.limits = parts.cells = parts.statistics = true;
  parts.state_period = parts.felt_period = look_period(overview);
  return parts;
}

Result<ReportInput> report_of_session(SessionFile session, const std::string& command) {
  if (session.steps.empty()) {
    return Error{fmt::format("{}: nothing was planned in it, so there is nothing to report", session.name)};
  }
  ReportInput report;
  report.recording = session.name;
  report.rate_hz = number_or(session.run("rate_hz"), 20.0);
  report.scale = number_or(session.run("scale"), 1.0);
  const std::string recorded = session.run("recorded"), started = session.run("started");
  // Its name has the time when the program started and the number of the file.
  const bool is_named = !started.empty() && session.name.rfind(started.substr(0, started.find(' ')), 0) == 0;
  report.recorded = recorded.empty() && !is_named ? started : recorded;
  std::vector<double> scales;
  for (const SettingsChange& change : session.settings) {
    if (std::find(scales.begin(), scales.end(), change.scale) == scales.end()) scales.push_back(change.scale);
  }
  for (const double scale : scales) report.scales += fmt::format("{}{:.3g}", report.scales.empty() ? "" : ", ", scale);
  report.command = command;
  report.story = tell_story(session);
  for (const McapLoss& loss : session.overview.lost) report.lost.push_back(to_text(loss));
  report.motion = motion_json(session, look_period(session.overview), kMostRows);
  report.begin_s = begin_of(session);
  report.profiles = split_by_settings(std::move(session));
  count_from_begin(report);
  return report;
}

Result<ReportInput> load_session_report(const std::filesystem::path& path) {
  const Result<McapOverview> overview = read_mcap(path);
  if (!overview) return overview.error();
  SessionParts parts = replayed_parts(*overview);
  parts.commands = true;
  parts.most_commands = kMostCommands;
  Result<SessionFile> session = load_session(path, parts);
  if (!session) return session.error();
  Result<ReportInput> report = report_of_session(*std::move(session), "./steadyhand report " + path.string());
  if (!report) return Error{path.string() + ": " + report.error().message};
  return report;
}

}  // namespace steadyhand
