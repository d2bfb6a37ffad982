#include "steadyhand/console/session_library.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "steadyhand/console/modest_process.hpp"
#include "steadyhand/live/realtime.hpp"
#include "steadyhand/record/session_file.hpp"
#include "steadyhand/report/past_session.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

constexpr double kMotionPeriod = 1.0 / 30.0;  ///< s between two looks at the arm; the page fills in between
constexpr double kMostLooks = 54000.0;        ///< half an hour; of a longer session they are further apart

std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

FreshPage list(const fs::path& folder) {
  Json sessions = Json::array();
  for (const SessionEntry& entry : list_sessions(folder)) {
    sessions.push_back({{"name", entry.name},
                        {"duration_s", entry.duration},
                        {"bytes", entry.bytes},
                        {"complete", entry.complete},
                        {"run", entry.run},
                        {"summary", entry.summary}});
  }
  return {dump({{"sessions", std::move(sessions)}}), "application/json"};
}

Result<FreshPage> motion(const fs::path& file) {
  const Result<McapOverview> overview = read_mcap(file);
  if (!overview) return overview.error();
  SessionParts parts;
  parts.states = true;
  parts.state_period = std::max(kMotionPeriod, to_seconds(overview->last - overview->first) / kMostLooks);
  const Result<SessionFile> session = load_session(file, parts);
  if (!session) return session.error();
  // Written by hand: a session of hours would be a tree of millions of nodes.
  std::string t, q;
  for (const JointState& state : session->states) {
    if (!state.q.allFinite()) continue;  // JSON has no word for it
    fmt::format_to(std::back_inserter(t), "{}{:.4f}", t.empty() ? "" : ",", to_seconds(state.stamp.made));
    q += q.empty() ? "[" : ",[";
    for (Eigen::Index i = 0; i < state.q.size(); ++i) {
      fmt::format_to(std::back_inserter(q), "{}{:.5f}", i > 0 ? "," : "", state.q[i]);
    }
    q += "]";
  }
  if (t.empty()) return Error{session->name + ": the arm never said where it was"};
  return FreshPage{fmt::format("{{\"name\":{},\"t_s\":[{}],\"q\":[{}]}}", dump(session->name), t, q),
                   "application/json"};
}

Result<FreshPage> report(const fs::path& file) {
  const Result<ReportInput> input = load_session_report(file);
  if (!input) return input.error();
  Result<std::string> page = report_page(*input);
  if (!page) return page.error();
  return FreshPage{*std::move(page), "text/html; charset=utf-8", true};
}

/// Names that SessionRecorder gives: nothing that leaves the folder.
bool is_name(const std::string& text) {
  const auto fits = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_' ||
           c == '.';
  };
  return !text.empty() && text.size() <= 128 && text.front() != '.' && std::all_of(text.begin(), text.end(), fits);
}

}  // namespace

Result<FreshPage> read_library(const fs::path& folder, const std::string& path) {
  if (path == "/sessions") return list(folder);
  const std::string_view prefix = "/sessions/";
  const std::size_t slash = path.find('/', prefix.size());
  if (path.compare(0, prefix.size(), prefix) == 0 && slash != std::string::npos) {
    const std::string name = path.substr(prefix.size(), slash - prefix.size()), part = path.substr(slash + 1);
    const fs::path file = folder / (name + ".mcap");
    if (is_name(name) && part == "motion") return motion(file);
    if (is_name(name) && part == "report.html") return report(file);
  }
  return Error{"there is /sessions, and of each session /sessions/NAME/motion and /sessions/NAME/report.html"};
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
  {
    const std::lock_guard lock(mutex_);
    asked_.emplace_back(path, std::move(answer));
  }
  changed_.notify_all();
}

Result<FreshPage> SessionLibrary::ask(const std::string& path) const {
  try {
    Result<std::string> body =
        output_of({program_.string(), {"report", "--sessions", folder_.string(), "--answer", path}}, ending_);
    if (!body) {
      std::string message = body.error().message;
      const std::string_view name = "steadyhand: ";
      return Error{message.compare(0, name.size(), name) == 0 ? message.substr(name.size()) : message};
    }
    const bool document = path.size() > 5 && path.compare(path.size() - 5, 5, ".html") == 0;
    return FreshPage{*std::move(body), document ? "text/html; charset=utf-8" : "application/json", document};
  } catch (const std::exception& error) {  // out of memory
    return Error{error.what()};
  }
}

void SessionLibrary::work() {
  name_thread("library");
  for (std::unique_lock lock(mutex_);;) {
    changed_.wait(lock, [this] { return ending_ || !asked_.empty(); });
    if (asked_.empty()) return;
    const auto [path, answer] = std::move(asked_.front());
    asked_.pop_front();
    lock.unlock();
    answer(ending_ ? Error{"the program ends"} : ask(path));
    lock.lock();
  }
}

}  // namespace steadyhand
