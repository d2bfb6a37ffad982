#pragma once

#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/names.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// A mark of an episode of a session: a message on /episode. For each value, the last mark that sets it counts.
struct EpisodeMark {
  enum class Kind {
    kBegin,
    kKeep,     ///< the episode ends, if it runs, and is kept
    kDiscard,  ///< the episode ends, if it runs, and is discarded
    kMark,     ///< its success, task or notes, and no more
  };
  Time at{0};
  int episode = 0;  ///< its number in the session, from 1
  Kind kind = Kind::kBegin;
  std::optional<bool> success;  ///< absent: unchanged or unknown
  std::string task;             ///< the task in words; empty: unchanged
  std::string notes;            ///< for people; empty: unchanged
};

/// Whether it reached the recording in which its episode began. If the recording ends within the episode: kBegin, and
/// not recorded.
struct EpisodeOutcome {
  int episode = 0;
  EpisodeMark::Kind kind = EpisodeMark::Kind::kBegin;
  bool recorded = false;
};

constexpr auto names_of(EpisodeMark::Kind) {
  using enum EpisodeMark::Kind;
  return named("EpisodeKind", {Name{kBegin, "begin"}, Name{kKeep, "keep", "the episode ends, if it runs, and is kept"},
                               Name{kDiscard, "discard", "the episode ends, if it runs, and is discarded"},
                               Name{kMark, "mark", "result, task or notes only"}});
}

/// A look at a simulated scene and how its task goes: a message on /scene.
struct SceneLook {
  SceneState scene;
  TaskProgress progress;
};

}  // namespace steadyhand
