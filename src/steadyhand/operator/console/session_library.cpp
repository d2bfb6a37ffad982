#include "steadyhand/operator/console/session_library.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "steadyhand/core/attempt.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "steadyhand/operator/console/modest_process.hpp"
#include "steadyhand/report/figures/motion.hpp"
#include "steadyhand/report/figures/past_session.hpp"
#include "steadyhand/session/live/realtime_threads.hpp"

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

Result<FreshPage> motion(const fs::path& file) {
  const Result<McapOverview> overview = read_mcap(file);
  if (!overview) return overview.error();
  const Result<SessionFile> session = load_session(file, replayed_parts(*overview));
  if (!session) return session.error();
  const bool moved = std::ranges::any_of(session->states, [](const JointState& state) { return state.q.allFinite(); });
  if (!moved) return Error{session->name + ": the arm never reported its position"};
  return FreshPage{motion_json(*session, look_period(*overview)), "application/json"};
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
