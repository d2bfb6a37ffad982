#include "steadyhand/files/archive/session_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

namespace steadyhand {

namespace {

constexpr double kHandRate = 250.0, kArmRate = 500.0, kStepRate = 60.0, kLookRate = 120.0;  // Hz, at most
/// s; profiles engaged for less are not named. Not a share of the session, which grows: a named profile stays named.
constexpr double kInPassing = 0.2;
constexpr Time kStatisticsPeriod = std::chrono::seconds(1);

std::string date_and_time() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof(text), "%Y-%m-%d_%H-%M-%S", &utc)};
}

}  // namespace

SessionRecorder::Flight::Flight(double seconds, int tools)
    : samples(tools * kHandRate * seconds),
      targets(tools * kHandRate * seconds),
      steps(kStepRate * seconds),
      commands(kArmRate * seconds),
      states(kArmRate * seconds),
      changes(100.0),
      liquid(tools * kLookRate * seconds) {}

SessionRecorder::SessionRecorder(const Ocp& ocp, const RecordingSettings& settings, Metadata metadata, Time begin,
                                 std::unique_ptr<RecordingPlace> place, std::vector<CameraInfo> cameras)
    : settings_(settings),
      place_(std::move(place)),
      metadata_(std::move(metadata)),
      names_(run_names(ocp.model(), ocp.objectives())),
      begin_(begin),
      stem_(date_and_time()),
      describer_(ocp.model()),
      wanted_(settings.enabled),
      cameras_(std::move(cameras)),
      needs_key_(cameras_.size()),
      has_begun_(cameras_.size()) {
  metadata_["run"]["started"] = stem_ + " UTC";
  if (settings.flight_seconds > 0.0) flight_.emplace(settings.flight_seconds, names_.tool_count());
  if (settings.enabled) begin_file();
}

Result<Recorder> SessionRecorder::create(std::unique_ptr<McapSink> sink) const {
  RecorderSettings settings;
  settings.names = names_;
  settings.live = true;
  settings.cameras = cameras_;
  Result<Recorder> recorder = Recorder::create(std::move(sink), settings);
  if (!recorder) return recorder;
  for (const auto& [name, entries] : metadata_) {
    if (Status s = recorder->add_metadata(name, entries); !s) return s.error();
  }
  return recorder;
}

void SessionRecorder::begin_file() {
  const auto begin = [&]() -> Status {
    if (const std::string why = place_->no_room(); !why.empty()) return Error{why};
    auto opened = place_->open([&](int i) { return i == 1 ? stem_ : fmt::format("{}_{}", stem_, i); });
    if (!opened) return opened.error();
    metadata_["run"]["recorded"] = date_and_time() + " UTC";  // a program makes several
    Result<Recorder> recorder = create(std::move(opened->sink));
    if (!recorder) return recorder.error();
    {
      const Lock lock(mutex_);
      opened_ = *std::move(opened);
      ++files_;
    }
    file_.emplace(*std::move(recorder));
    has_begun_.assign(cameras_.size(), false);
    return Done{};
  };
  if (const Status begun = begin(); !begun) {
    wanted_ = false;
    return notice("not recorded: " + begun.error().message);
  }
  recording_ = true;
  if (const std::string done = place_->make_room(opened_); !done.empty()) notice(done);
}

void SessionRecorder::end_file() {
  if (!file_) return;
  const Status closed = file_->close();
  file_.reset();
  recording_ = false;
  lose_episode();
  notice(!closed                    ? "the recording ended: " + closed.error().message
         : place_->is_gone(opened_) ? "the recording was deleted or moved away: " + opened_.where
                                    : "recorded: " + opened_.where);
}

/// Names, longest engaged first; without those engaged for less than kInPassing, unless liquid spilled under them.
std::string SessionRecorder::profiles_that_led() const {
  const std::vector<SpillLog::Spill> spills = spills_of(tally_.liquids);
  std::vector<std::pair<double, std::string>> led;
  for (const auto& [name, seconds] : tally_.led_by) {
    const auto spilled = [&name = name](const SpillLog::Spill& spill) { return spill.profile == name; };
    if (seconds >= kInPassing || std::any_of(spills.begin(), spills.end(), spilled)) led.emplace_back(-seconds, name);
  }
  std::sort(led.begin(), led.end());
  std::string names;
  for (const auto& [seconds, name] : led) names += (names.empty() ? "" : ", ") + name;
  return names;
}

/// The entries that every summary of the current file has.
std::map<std::string, std::string> SessionRecorder::spilled_and_led() const {
  const std::vector<SpillLog::Spill> spills = spills_of(tally_.liquids);
  const SpillLog::Spill* worst = worst_of(spills);
  return {{"spilled", worst ? "yes" : "no"},
          {"spills", fmt::format("{}", spills.size())},
          {"spilled_share", fmt::format("{:.6g}", worst ? worst->share : 0.0)},
          {"spilled_profile", worst ? worst->profile : ""},
          {"profiles", profiles_that_led()}};
}

/// Adds a summary of the file while its session continues; the last summary counts.
void SessionRecorder::sum_up(const SessionSnapshot& now) {
  if (!file_) return;
  const auto number = [](double value) { return fmt::format("{:.6g}", value); };
  Time engaged = tally_.engaged;
  if (engaged_since_) engaged += std::max(Time(0), tally_.last - std::max(*engaged_since_, tally_.begin));
  std::map<std::string, std::string> summary = spilled_and_led();
  summary.merge(std::map<std::string, std::string>{
      {"duration_s", number(to_seconds(tally_.last - tally_.begin))},
      {"engaged_s", number(to_seconds(engaged))},
      {"latency_p50_ms", number(1e-3 * now.latency_us.p50)},
      {"latency_p99_ms", number(1e-3 * now.latency_us.p99)},
      {"missed_deadlines", fmt::format("{}", now.missed_deadlines - tally_.missed_before)}});
  const Status added = file_->add_metadata("summary", summary);
  if (!added) notice("the recording has no summary: " + added.error().message);
}

/// One message to the file.
template <typename... Message>
void SessionRecorder::write(const Message&... message) {
  if (file_) check(file_->write(message...));
}

/// If writing failed the recording is over.
void SessionRecorder::check(const Status& written) {
  if (written) return;
  wanted_ = recording_ = false;
  file_.reset();
  lose_episode();
  notice("the recording ended, the session continues: " + written.error().message);
}

/// The same message, its stamps counted from the session's begin.
template <typename Message>
Message SessionRecorder::from_begin(Message message) const {
  message.stamp.hand -= begin_;
  message.stamp.made -= begin_;
  return message;
}

LiveTaps SessionRecorder::taps() {
  LiveTaps taps;
  const auto keep = [this](const auto& message, auto history) {
    write(message);
    if (flight_) ((*flight_).*history).push(message);
  };
  taps.sample = [=, this](const OperatorSample& sample) { keep(from_begin(sample), &Flight::samples); };
  taps.target = [=, this](const Target& target) { keep(from_begin(target), &Flight::targets); };
  taps.command = [=, this](const JointCommand& command) { keep(from_begin(command), &Flight::commands); };
  taps.state = [=, this](const JointState& state) { keep(from_begin(state), &Flight::states); };
  taps.change = [=, this](SupervisionChange change) {
    change.at -= begin_;
    if (engaged_since_) tally_.engaged += change.at - std::max(*engaged_since_, tally_.begin);
    engaged_[change.tool] = change.to == SupervisionState::kEngaged;
    engaged_since_ = engaged_[0] || engaged_[1] ? std::optional(change.at) : std::nullopt;
    keep(change, &Flight::changes);
    if (change.is_failure && failed_ != change.at) fault_ = change;  // one for all tools
    if (change.is_failure) failed_ = change.at;
  };
  taps.settings = [this](const AppliedSettings& applied) { write_settings(applied); };
  taps.cell = [this](Time at, const Cell& cell) { take_cell(at, cell); };
  taps.step = [this](const PlanningRecord& record) { write_step(record); };
  taps.look = [this](const SessionSnapshot& snapshot) { look(snapshot); };
  return taps;
}

void SessionRecorder::write_settings(const AppliedSettings& applied) {
  SettingsChange& change = operator_settings_.emplace();
  change.at = applied.at - begin_;
  for (int i = 0; i < applied.settings.objectives; ++i) {
    const JointVector& weights = applied.settings.weights[i];
    change.weights[names_.terms[i]].assign(weights.begin(), weights.end());
  }
  change.scale = applied.settings.scale;
  change.yaw = applied.settings.yaw;
  change.tilt = applied.settings.tilt_max;
  change.no_spill = applied.settings.no_spill;
  change.fill = applied.settings.fill;
  if (applied.settings.latency > 0.0) change.latency = applied.settings.latency;
  if (applied.settings.prediction) change.prediction = to_string(*applied.settings.prediction);
  change.profile = applied.settings.profile;
  write(change);
}

void SessionRecorder::take_cell(Time at, const Cell& cell) {
  cell_ = cell;
  cell_at_ = at - begin_;
  (void)describer_.set_cell(cell, at);  // which the session has looked at
  if (flight_) {
    const Time oldest = cell_at_ - from_seconds(settings_.flight_seconds);
    std::deque<CellChange>& cells = flight_->cells;
    cells.push_back({cell_at_, cell});
    while (cells.size() > 1 && cells[1].at <= oldest) cells.pop_front();
  }
  write(cell_at_, cell);
}

void SessionRecorder::write_step(const PlanningRecord& record) {
  if (!file_ && !flight_) return;
  PlanStep step = describer_.describe(record.plan, record.at, record.ocp->horizon(), record.solved);
  step.t_s = to_seconds(record.at - begin_);
  for (int t = 0; t < step.tool_count; ++t) {
    step.tools[t].X_base_target = record.X_base_target[t];
    step.tools[t].engaged = record.engaged[t];
  }
  write(step);
  if (flight_) flight_->steps.push(step);
  if (!file_ || record.at < next_plan_) return;
  next_plan_ = record.at + from_seconds(1.0 / settings_.plan_rate_hz);
  Plan plan = from_begin(record.plan);
  plan.start -= begin_;
  plan.stamp.made = record.at - begin_;
  Reference reference = from_begin(record.reference);
  reference.start -= begin_;
  reference.stamp.made = record.at - begin_;
  write(reference);
  write(plan, describer_.paths(plan));
}

Status SessionRecorder::mark(const EpisodeMark& mark) {
  const Lock lock(mutex_);
  if (mark.kind == EpisodeMark::Kind::kBegin) episode_file_ = files_;
  if (!recording_ || episode_file_ != files_) {
    return Error{fmt::format("the recording of episode {} has ended; what it says of the episode stays", mark.episode)};
  }
  marks_.emplace_back(mark, files_);
  return Done{};
}

std::vector<EpisodeOutcome> SessionRecorder::take_episode_outcomes() {
  const Lock lock(mutex_);
  return std::exchange(outcomes_, {});
}

void SessionRecorder::report(const EpisodeOutcome& outcome) {
  const Lock lock(mutex_);
  outcomes_.push_back(outcome);
}

/// The file has ended.
void SessionRecorder::lose_episode() {
  if (const int lost = std::exchange(running_, 0)) report({lost, EpisodeMark::Kind::kBegin, false});
}

/// @return whether the file has it; it may be another than that of the mark by now, or deleted
bool SessionRecorder::write_mark(EpisodeMark mark, int file) {
  using Kind = EpisodeMark::Kind;
  if (!file_ || file != files_) return false;
  mark.at -= begin_;
  write(mark);
  if (mark.kind == Kind::kBegin && file_) running_ = mark.episode;
  if (mark.kind == Kind::kBegin || mark.kind == Kind::kMark) return file_.has_value();
  if (file_) check(file_->flush());
  if (file_ && place_->is_gone(opened_)) end_file();
  if (!file_) return false;
  running_ = 0;
  return true;
}

void SessionRecorder::see(const SceneLook& look) {
  const Lock lock(mutex_);
  if (looks_.size() < kMostLooks) looks_.push_back(look);
}

void SessionRecorder::film(VideoPacket packet) {
  const Lock lock(mutex_);
  const auto camera = static_cast<std::size_t>(packet.camera);
  if (pictures_.size() >= kMostPictures) needs_key_[camera] = true;
  if (packet.is_key && pictures_.size() < kMostPictures) needs_key_[camera] = false;
  if (needs_key_[camera]) return;
  pictures_.push_back(std::move(packet));
}

/// Writes data that other threads have left for the file.
void SessionRecorder::write_waiting() {
  std::vector<std::pair<EpisodeMark, int>> marks;
  std::vector<SceneLook> looks;
  std::vector<VideoPacket> pictures;
  {
    const Lock lock(mutex_);
    marks = std::exchange(marks_, {});
    looks = std::exchange(looks_, {});
    pictures = std::exchange(pictures_, {});
  }
  for (VideoPacket& picture : pictures) {
    const auto camera = static_cast<std::size_t>(picture.camera);
    has_begun_[camera] = has_begun_[camera] || picture.is_key;
    if (!has_begun_[camera]) continue;
    picture.stamp.hand -= begin_;
    picture.stamp.made -= begin_;
    write(picture);
  }
  for (SceneLook& look : looks) {
    look.scene.at -= begin_;
    write(look);
  }
  for (const auto& [mark, file] : marks) report({mark.episode, mark.kind, write_mark(mark, file)});
}

/// Once a round: values that no tap delivers, and requests.
void SessionRecorder::look(const SessionSnapshot& now) {
  const bool begins = wanted_ && !file_;
  if (begins) begin_file();
  const Time at = now.now - begin_;
  if (begins || tally_.last == Time(0)) {
    tally_ = {};
    tally_.begin = tally_.last = std::max(at, Time(0));  // the first snapshots may be from before the session's begin
    tally_.missed_before = now.missed_deadlines;
  }
  if (!wanted_ && file_ && at - tally_.begin >= kShortestFile) {
    write_waiting();  // what was said before belongs in it
    sum_up(now);
    end_file();
  }
  if (at < Time(0)) return;
  for (int t = 0; t < now.tool_count; ++t) {
    tally_.liquids[t].see(at, now.tools[t].liquid, operator_settings_ ? operator_settings_->profile : "");
  }
  if (now.state == SupervisionState::kEngaged && operator_settings_ && !operator_settings_->profile.empty()) {
    tally_.led_by[operator_settings_->profile] += to_seconds(at - tally_.last);
  }
  tally_.last = at;
  if (begins) {
    if (operator_settings_) {
      operator_settings_->at = at;
      write(*operator_settings_);
    }
    if (cell_) write(at, cell_after(*cell_, to_seconds(at - cell_at_)));
  }
  write_waiting();
  for (int t = 0; t < now.tool_count; ++t) {
    write(at, now.tools[t].liquid, t);
    if (flight_) flight_->liquid.push({at, now.tools[t].liquid, t});
  }
  const ActiveConstraint& c = now.constraint;
  if (c.kind != constraint_.kind || c.first != constraint_.first || c.second != constraint_.second) {
    constraint_ = c;
    write(at, c);
  }
  if (at >= next_statistics_) {
    next_statistics_ = at + kStatisticsPeriod;
    write(SessionStatistics{at, now.latency_us, now.solve_us, now.wake_us, now.samples, now.plans, now.rejected_plans,
                            now.cycles, now.missed_deadlines, now.planner_rate_hz});
    if (!begins) sum_up(now);  // a killed program cannot do this later
    if (const std::string why = file_ ? place_->no_room() : ""; !why.empty()) {
      wanted_ = false;
      sum_up(now);
      end_file();
      notice("the recording ended, the session continues: " + why);
    }
    if (file_ && place_->is_gone(opened_)) end_file();  // the next round begins another
  }
  if (fault_) write_flight();
}

void SessionRecorder::write_flight() {
  const SupervisionChange fault = *fault_;
  fault_.reset();
  if (!flight_ || flights_ == kMostFlights) return;
  const int flight = ++flights_;
  std::string where;
  const auto write_all = [&]() -> Status {
    auto opened = place_->open([&](int i) { return fmt::format("{}-fault-{}", stem_, flight + i - 1); });
    if (!opened) return opened.error();
    where = opened->where;
    Result<Recorder> file = create(std::move(opened->sink));
    if (!file) return file.error();
    Status status = file->add_metadata(
        "fault", {{"at_s", fmt::format("{}", to_seconds(fault.at))}, {"reason", std::string(fault.reason)}});
    const auto put = [&](const auto& message) {
      if (status) status = file->write(message);
    };
    const Time oldest = fault.at - from_seconds(settings_.flight_seconds);
    for (std::size_t i = 0; status && i < flight_->cells.size(); ++i) {
      const auto& [at, cell] = flight_->cells[i];
      if (i + 1 < flight_->cells.size() && flight_->cells[i + 1].at <= oldest) continue;  // another came before
      const Time first = std::max(at, oldest);
      status = file->write(first, cell_after(cell, to_seconds(first - at)));
    }
    flight_->samples.for_each(put);
    flight_->targets.for_each(put);
    flight_->steps.for_each(put);
    flight_->commands.for_each(put);
    flight_->states.for_each(put);
    flight_->changes.for_each(put);
    flight_->liquid.for_each([&](const auto& entry) {
      if (status) status = file->write(entry.at, entry.liquid, entry.tool);
    });
    return status ? file->close() : status;
  };
  const Status written = write_all();
  notice(written ? fmt::format("the last {} s before the fault: {}", settings_.flight_seconds, where)
                 : "the flight recorder failed: " + written.error().message);
}

void SessionRecorder::notice(const std::string& line) {
  const Lock lock(mutex_);
  notices_.push_back(line);
}

std::string SessionRecorder::writing() const {
  const Lock lock(mutex_);
  return recording_ ? opened_.name : std::string();
}

std::vector<std::string> SessionRecorder::take_notices() {
  const Lock lock(mutex_);
  return std::exchange(notices_, {});
}

void SessionRecorder::finish(const LiveSummary& s) {
  write_waiting();
  if (!file_) return;
  std::string holds;
  for (const auto& [reason, count] : s.holds) {
    holds += fmt::format("{}{} x {}", holds.empty() ? "" : "; ", count, reason);
  }
  const auto number = [](double value) { return fmt::format("{:.6g}", value); };
  std::map<std::string, std::string> summary = spilled_and_led();
  summary.merge(std::map<std::string, std::string>{{"duration_s", number(s.duration)},
                                                   {"engaged_s", number(s.engaged)},
                                                   {"engagements", fmt::format("{}", s.engagements)},
                                                   {"latency_p50_ms", number(1e-3 * s.latency_us.p50)},
                                                   {"latency_p99_ms", number(1e-3 * s.latency_us.p99)},
                                                   {"solve_p50_us", number(s.solve_us.p50)},
                                                   {"solve_p99_us", number(s.solve_us.p99)},
                                                   {"plans", fmt::format("{}", s.plans)},
                                                   {"failed_plans", fmt::format("{}", s.failed_plans)},
                                                   {"cycles", fmt::format("{}", s.cycles)},
                                                   {"missed_deadlines", fmt::format("{}", s.missed_deadlines)},
                                                   {"dropped_messages", fmt::format("{}", s.tap_drops)},
                                                   {"beyond_limits", fmt::format("{}", s.monitor.beyond_limits)},
                                                   {"in_contact", fmt::format("{}", s.monitor.in_contact)},
                                                   {"held_back", holds}});
  const Status added = file_->add_metadata("summary", summary);
  if (!added) notice("the recording ended: " + added.error().message);
  end_file();
}

}  // namespace steadyhand
