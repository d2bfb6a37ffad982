#pragma once

#include <map>
#include <optional>

#include "steadyhand/core/describe.hpp"
#include "steadyhand/core/mutex.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/files/record/episode_mark.hpp"

namespace steadyhand {

/// How the episodes of a session stand.
struct EpisodeView {
  bool running = false;
  int number = 0;               ///< of the one that runs, or ran last; 0: there was none
  double time = 0.0;            ///< s, that it has run
  int kept = 0, discarded = 0;  ///< in this session, and recorded
  int lost = 0;                 ///< in this session: not recorded to their end
  std::optional<bool> success;  ///< what was said of it
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

/// Numbers the episodes of a session and keeps order among what is said of them. Any thread.
class Episodes {
 public:
  /// What is to be recorded of a wish, made whole: its number, and without a word on success what the task's end says.
  /// Fails on an episode that begins within one, and where there is none that is kept, discarded or marked, or a lost
  /// one; then nothing changes.
  /// @param mark its episode is not read. @param decided of the simulated task
  Result<EpisodeMark> take(EpisodeMark mark, std::optional<bool> decided);
  /// Counts the episode, once it is known what the recording has of it.
  /// @return whether it is lost by this
  bool settle(const EpisodeOutcome& outcome, Time now);
  EpisodeView view(Time now) const;

 private:
  enum class End { kKept, kDiscarded, kLost };
  int& count(End end);

  mutable Mutex mutex_;
  EpisodeView view_;
  Time begin_{0};
  std::map<int, End> ends_;  ///< of those that are settled
};

}  // namespace steadyhand
