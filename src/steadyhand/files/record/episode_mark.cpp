#include "steadyhand/files/record/episode_mark.hpp"

namespace steadyhand {

namespace {
constexpr std::string_view kKinds[] = {"begin", "keep", "discard", "mark"};
}

std::string_view to_string(EpisodeMark::Kind kind) { return kKinds[static_cast<int>(kind)]; }

std::optional<EpisodeMark::Kind> find_episode_kind(std::string_view name) {
  for (int i = 0; i < 4; ++i) {
    if (kKinds[i] == name) return static_cast<EpisodeMark::Kind>(i);
  }
  return std::nullopt;
}

}  // namespace steadyhand
