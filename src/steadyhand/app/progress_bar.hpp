#pragma once

#include <chrono>
#include <string>

namespace steadyhand {

/// One line on stderr that is redrawn: which run, how far, and the time left, estimated from the time taken so far. Off
/// a terminal it says one line per run instead.
class ProgressBar {
 public:
  explicit ProgressBar(int runs);

  /// @param fraction of the current run, 0..1
  void show(const std::string& run, double fraction);
  void next() { ++done_; }
  /// Clears the line.
  void finish();

 private:
  int runs_, done_ = 0, announced_ = -1;
  bool terminal_;
  std::chrono::steady_clock::time_point start_, drawn_;
};

}  // namespace steadyhand
