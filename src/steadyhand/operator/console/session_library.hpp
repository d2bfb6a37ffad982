#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "steadyhand/operator/console/session_edits.hpp"
#include "steadyhand/operator/server/server.hpp"

namespace steadyhand {

/// Recorded sessions for the operator's page. A separate process with low priority and limited memory reads them one
/// after another, so that requests do not disturb a running session. docs/reference/protocol.md has the contents of the
/// answers.
class SessionLibrary {
 public:
  using Answer = std::function<void(Result<FreshPage>)>;

  /// @param folder need not exist yet
  /// @param program what answers, as `PROGRAM report --sessions FOLDER --answer PATH`
  SessionLibrary(std::filesystem::path folder, std::filesystem::path program);
  /// Ends at once: what is not answered yet is answered with an error.
  ~SessionLibrary();

  /// For ServerCallbacks::on_fetch; any path at all. Does not wait.
  void fetch(const std::string& path, Answer answer);
  /// Labels, renames or deletes a session later, then calls `done` from the library's thread; returns an error at once
  /// if that is impossible. Does not wait. @param written name of the session that is recorded now; empty: none
  Status edit(const SessionEdit& edit, const std::string& written, std::function<void(Status)> done);

 private:
  void work();
  void add(std::function<void()> task);
  bool promise(const std::string& name);
  void take_back(const std::string& name);
  Result<FreshPage> ask(const std::string& path) const;

  const std::filesystem::path folder_, program_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  std::set<std::string> promised_;  ///< names that renames under way take
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

/// The answer itself, in `body` except for files: "/sessions", "/sessions/NAME/motion", "/report.html" or
/// "/session.mcap"; any path at all.
Result<FreshPage> read_library(const std::filesystem::path& folder, const std::string& path);

}  // namespace steadyhand
