#pragma once

#include <chrono>
#include <string>

namespace steadyhand {

/// One line on stderr that is redrawn: which run, how far, and the time left, estimated from the time taken so far.
/// Without a terminal it prints one line per run instead or, for a single run in steps, one per step.
class ProgressBar {
 public:
  /// @param doing what is said of each run off a terminal
  explicit ProgressBar(int runs, std::string doing = "replaying");

  /// @param fraction of the current run, 0..1
  void show(const std::string& run, double fraction);
  void next() { ++done_; }
  /// Clears the line, if there is one.
  void finish();

 private:
  std::string doing_;
  std::string announced_;
  int runs_, done_ = 0;
  bool terminal_, there_ = false;
  std::chrono::steady_clock::time_point start_, drawn_;
};

}  // namespace steadyhand
