#pragma once

#include <map>
#include <optional>

#include "steadyhand/core/describe.hpp"
#include "steadyhand/core/mutex.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/files/record/episode_mark.hpp"

namespace steadyhand {

/// State of a session's episodes.
struct EpisodeView {
  bool running = false;
  int number = 0;               ///< current or newest episode; 0: none yet
  double time = 0.0;            ///< s, its duration so far
  int kept = 0, discarded = 0;  ///< in this session, and recorded
  int lost = 0;                 ///< in this session: not recorded to their end
  std::optional<bool> success;  ///< as marked
};
template <typename V>
void describe(V& v, EpisodeView& e) {
  v.type("Episode", "The one that runs, or ran last.");
  v.add("running", "", "", e.running);
  v.add("number", "", "from 1; 0: there was none", e.number, at_least(0));
  v.add("time", "s", "time that it has run", e.time);
  v.add("kept", "", "episodes, recorded", e.kept, at_least(0));
  v.add("discarded", "", "episodes, recorded", e.discarded, at_least(0));
  v.add("lost", "", "episodes that are not recorded to their end", e.lost, at_least(0));
  v.add("success", "", "null: not decided", e.success, kOrNull);
}

/// Numbers the episodes of a session and orders the marks of them. Any thread.
class Episodes {
 public:
  /// Completes a mark for the recording: adds the episode's number and, if the mark has no success, the task's result.
  /// Fails on an episode that begins within another, if there is no episode to keep, discard or mark, and on a lost
  /// one; then nothing changes.
  /// @param mark its episode is not read. @param decided of the simulated task
  Result<EpisodeMark> take(EpisodeMark mark, std::optional<bool> decided);
  /// Counts the episode, once the recorder has reported what it recorded.
  /// @return whether it is lost by this
  bool settle(const EpisodeOutcome& outcome, Time now);
  EpisodeView view(Time now) const;

 private:
  enum class End { kKept, kDiscarded, kLost };
  int& count(End end);

  mutable Mutex mutex_;
  EpisodeView view_;
  Time begin_{0};
  std::map<int, End> ends_;  ///< of settled episodes
};

}  // namespace steadyhand
