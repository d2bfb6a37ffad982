#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "serve/server.hpp"

namespace steadyhand {

/// Recorded sessions for the operator's page, read on a thread of its own and of low priority, one request after
/// another, so that nobody who asks disturbs a session that runs. docs/protocol.md says what the answers hold.
class SessionLibrary {
 public:
  using Answer = std::function<void(Result<FreshPage>)>;

  /// @param folder need not exist yet
  explicit SessionLibrary(std::filesystem::path folder);
  /// Answers what was asked for before, then ends.
  ~SessionLibrary();

  /// For ServerCallbacks::on_fetch; any path at all. Does not wait.
  void fetch(const std::string& path, Answer answer);
  /// The same at once, on the caller's thread: "/sessions", "/sessions/NAME/motion", "/sessions/NAME/report.html".
  Result<FreshPage> read(const std::string& path) const;

 private:
  void work();

  std::filesystem::path folder_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<std::string, Answer>> asked_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace steadyhand
