#include "steadyhand/operator/console/session_library.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "steadyhand/core/attempt.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "steadyhand/operator/console/modest_process.hpp"
#include "steadyhand/report/figures/metrics.hpp"
#include "steadyhand/report/figures/past_session.hpp"
#include "steadyhand/report/figures/session_story.hpp"
#include "steadyhand/session/live/realtime.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

constexpr const char* kFileType = "application/octet-stream";

std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

FreshPage list(const fs::path& folder) {
  Json sessions = Json::array();
  for (const SessionEntry& entry : list_sessions(folder)) {
    sessions.push_back({{"name", entry.name},
                        {"duration_s", entry.duration},
                        {"bytes", entry.bytes},
                        {"complete", entry.complete},
                        {"label", session_label(folder, entry.name)},
                        {"run", entry.run},
                        {"summary", entry.summary},
                        {"fault", entry.fault}});
  }
  return {dump({{"sessions", std::move(sessions)}}), "application/json"};
}

/// Members of a JSON object, each a list with an entry for each row; the first has the rows' times. Written by hand: a
/// session of hours would be a tree of millions of nodes.
class Columns {
 public:
  template <typename... Names>
  explicit Columns(Names... names) : names_{names...}, lists_(sizeof...(names)) {}
  void begin_row(double t) {
    column_ = 0;
    add(t, 4);
  }
  /// What is not finite is null.
  void add(double value, int decimals) {
    separate();
    std::string& list = lists_[column_++];
    std::isfinite(value) ? (void)fmt::format_to(std::back_inserter(list), "{:.{}f}", value, decimals)
                         : (void)list.append("null");
  }
  template <typename List>
  void add_list(const List& values, int decimals) {
    separate();
    std::string& list = lists_[column_++];
    list += '[';
    for (int i = 0; i < static_cast<int>(values.size()); ++i) {
      fmt::format_to(std::back_inserter(list), "{}{:.{}f}", i > 0 ? "," : "", values[i], decimals);
    }
    list += ']';
  }
  bool empty() const { return lists_.front().empty(); }
  std::string json() const {
    std::string text;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      text += fmt::format("{}\"{}\":[{}]", i > 0 ? "," : "", names_[i], lists_[i]);
    }
    return text;
  }

 private:
  void separate() {
    if (!lists_[column_].empty()) lists_[column_] += ',';
  }

  std::vector<std::string> names_, lists_;
  std::size_t column_ = 0;
};

/// Which profile led, with which scale and fill, from when on.
std::string settings_of(const SessionFile& session) {
  Json settings = Json::array();
  for (const SettingsChange& change : session.settings) {
    const std::string profile = change.profile.empty() ? session.run("profile") : change.profile;
    if (!settings.empty() && settings.back()["profile"] == profile && settings.back()["scale"] == change.scale &&
        settings.back()["fill"] == change.fill.value_or(0.0)) {
      continue;
    }
    settings.push_back({{"t_s", to_seconds(change.at)},
                        {"profile", profile},
                        {"scale", change.scale},
                        {"fill", change.fill.value_or(0.0)}});
  }
  return dump(settings);
}

std::string events_of(const SessionFile& session) {
  Json events = Json::array();
  for (const SessionStory::Event& event : tell_story(session).events) {
    events.push_back({{"t_s", event.t_s}, {"kind", event.kind}, {"what", event.what}, {"why", event.why}});
    if (event.amount > 0.0) events.back()["amount"] = event.amount;
  }
  return dump(events);
}

/// What the liquid felt while the hand led, as the report counts it; null: nothing was measured then.
std::string slosh_of(const SessionFile& session) {
  std::vector<Felt> felt;
  for (const auto& each : felt_while_led(session)) felt.push_back({each.sum, each.largest, each.count});
  if (felt.empty()) return "null";
  Metrics metrics;
  count_felt(felt, metrics);
  return dump({{"mean", metrics.lateral_mean}, {"largest", metrics.lateral_max}});
}

/// mm, over all that was led, as the report has it for each setting; null: no hand led.
std::string off_target_of(const SessionFile& session) {
  const double mean = mean_position_error(session.steps);
  return std::isnan(mean) ? "null" : dump(1e3 * mean);
}

Result<FreshPage> motion(const fs::path& file) {
  const Result<McapOverview> overview = read_mcap(file);
  if (!overview) return overview.error();
  SessionParts parts;
  parts.states = parts.steps = parts.liquid = parts.changes = parts.settings = parts.limits = parts.cells =
      parts.statistics = true;
  const double period = parts.state_period = parts.felt_period = look_period(*overview);
  const Result<SessionFile> session = load_session(file, parts);
  if (!session) return session.error();
  Columns arm("t_s", "q", "gripper");
  for (const JointState& state : session->states) {
    if (!state.q.allFinite()) continue;  // JSON has no word for it
    arm.begin_row(to_seconds(state.stamp.made));
    arm.add_list(state.q, 5);
    arm.add(state.gripper.value_or(std::nan("")), 2);
  }
  if (arm.empty()) return Error{session->name + ": the arm never said where it was"};
  Columns hand("t_s", "p", "q", "engaged", "lateral", "error_mm");
  double last = -std::numeric_limits<double>::infinity();
  for (const PlanStep& step : session->steps) {
    const Pose& target = step.X_base_target;
    if (step.t_s - last < period - 1e-9) continue;
    if (!target.p.allFinite() || !target.q.coeffs().allFinite()) continue;
    hand.begin_row(last = step.t_s);
    hand.add_list(target.p, 4);
    hand.add_list(target.q.coeffs(), 4);
    hand.add(step.engaged ? 1.0 : 0.0, 0);
    hand.add(lateral_acceleration(step), 3);
    hand.add(step.engaged ? 1e3 * position_error(step) : std::nan(""), 1);
  }
  Columns felt("t_s", "mean", "largest", "count");
  for (const SessionFile::Felt& each : session->felt) {
    felt.begin_row(to_seconds(each.at));
    felt.add(each.mean(), 3);
    felt.add(each.largest, 3);
    felt.add(each.count, 0);
  }
  Columns liquid("t_s", "tilt", "freeboard_mm", "spilled", "spilled_share");
  for (const auto& [at, state] : session->liquid) {
    if (!std::isfinite(state.tilt_x) || !std::isfinite(state.tilt_y)) continue;
    liquid.begin_row(to_seconds(at));
    liquid.add_list(std::array{state.tilt_x, state.tilt_y}, 4);
    liquid.add(1e3 * state.freeboard, 1);
    liquid.add(state.spilled ? 1.0 : 0.0, 0);
    liquid.add(state.spilled_share, 3);
  }
  return FreshPage{fmt::format("{{\"name\":{},{},\"target\":{{{}}},\"felt\":{{{}}},\"slosh\":{},\"off_target_mm\":{},"
                               "\"liquid\":{{{}}},\"settings\":{},"
                               "\"events\":{}}}",
                               dump(session->name), arm.json(), hand.json(), felt.json(), slosh_of(*session),
                               off_target_of(*session), liquid.json(), settings_of(*session), events_of(*session)),
                   "application/json"};
}

Result<FreshPage> report(const fs::path& file) {
  Result<ReportInput> input = load_session_report(file);
  if (!input) return input.error();
  input->title = session_label(file.parent_path(), file.stem().string());
  Result<std::string> page = report_page(*input);
  if (!page) return page.error();
  return FreshPage{*std::move(page), "text/html; charset=utf-8", true};
}

/// "/sessions/NAME/PART".
struct PartOfSession {
  std::string name, part;
};

std::optional<PartOfSession> take_apart(const std::string& path) {
  const std::string_view prefix = "/sessions/";
  const std::size_t slash = path.find('/', prefix.size());
  if (path.compare(0, prefix.size(), prefix) != 0 || slash == std::string::npos) return std::nullopt;
  PartOfSession asked{path.substr(prefix.size(), slash - prefix.size()), path.substr(slash + 1)};
  return is_session_name(asked.name) ? std::optional(std::move(asked)) : std::nullopt;
}

std::uint64_t size_of(std::FILE* file) {
  struct stat about {};
  return fstat(fileno(file), &about) == 0 ? static_cast<std::uint64_t>(about.st_size) : 0;
}

std::shared_ptr<std::FILE> close_later(std::FILE* file) {
  return {file, [](std::FILE* open) {
            if (open) std::fclose(open);
          }};
}

/// The file as it is, to be read while it is sent.
Result<FreshPage> download(const fs::path& file) {
  std::error_code failed;
  const bool is_file = fs::is_regular_file(file, failed);  // opening a pipe would wait
  const auto open = close_later(is_file ? std::fopen(file.c_str(), "rbe") : nullptr);
  if (!open) return Error{file.filename().string() + ": cannot be read"};
  return FreshPage{{}, kFileType, false, open, size_of(open.get())};
}

}  // namespace

Result<FreshPage> read_library(const fs::path& folder, const std::string& path) {
  if (path == "/sessions") return list(folder);
  if (const std::optional<PartOfSession> asked = take_apart(path)) {
    const fs::path file = folder / (asked->name + ".mcap");
    if (asked->part == "motion") return motion(file);
    if (asked->part == "report.html") return report(file);
    if (asked->part == "session.mcap") return download(file);
  }
  return Error{"there is /sessions, and of each session /sessions/NAME/motion, /report.html and /session.mcap"};
}

SessionLibrary::SessionLibrary(fs::path folder, fs::path program)
    : folder_(std::move(folder)), program_(std::move(program)), thread_([this] { work(); }) {}

SessionLibrary::~SessionLibrary() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void SessionLibrary::fetch(const std::string& path, Answer answer) {
  add([this, path, answer = std::move(answer)] { answer(ending_ ? Error{"the program ends"} : ask(path)); });
}

Status SessionLibrary::edit(const SessionEdit& edit, const std::string& written, std::function<void(Status)> done) {
  if (Status possible = check_edit(folder_, edit, written); !possible) return possible;
  const bool renames = edit.kind == SessionEdit::Kind::kRename;
  if (renames && !promise(edit.to)) return Error{fmt::format("there is a recording '{}' already", edit.to)};
  add([this, edit, renames, done = std::move(done)] {
    Status carried_out = Done{};
    const Status attempted = attempt([&] { carried_out = carry_out(folder_, edit); });
    if (renames) take_back(edit.to);
    done(attempted ? carried_out : attempted);
  });
  return Done{};
}

/// @return whether no other rename under way is to take the name
bool SessionLibrary::promise(const std::string& name) {
  const std::lock_guard lock(mutex_);
  return promised_.insert(name).second;
}

void SessionLibrary::take_back(const std::string& name) {
  const std::lock_guard lock(mutex_);
  promised_.erase(name);
}

void SessionLibrary::add(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  changed_.notify_all();
}

/// Nothing is held in this process: what another one answers goes to a file without a name.
Result<FreshPage> SessionLibrary::ask(const std::string& path) const {
  try {
    const std::optional<PartOfSession> asked = take_apart(path);
    if (asked && asked->part == "session.mcap") return read_library(folder_, path);
    const auto file = close_later(std::tmpfile());
    if (!file) return Error{std::string("no room for an answer in /tmp: ") + std::strerror(errno)};
    const Status done = run_into({program_.string(), {"report", "--sessions", folder_.string(), "--answer", path}},
                                 fileno(file.get()), ending_);
    if (!done) {
      const std::string& message = done.error().message;
      const std::string_view name = "steadyhand: ";
      return Error{message.compare(0, name.size(), name) == 0 ? message.substr(name.size()) : message};
    }
    const bool document = path.ends_with("/report.html");
    return FreshPage{
        {}, document ? "text/html; charset=utf-8" : "application/json", document, file, size_of(file.get())};
  } catch (const std::exception& error) {  // out of memory
    return Error{error.what()};
  }
}

void SessionLibrary::work() {
  name_thread("library");
  for (std::unique_lock lock(mutex_);;) {
    changed_.wait(lock, [this] { return ending_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    (void)attempt(task);  // whom it would answer gets none
    lock.lock();
  }
}

}  // namespace steadyhand
