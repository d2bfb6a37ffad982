#include "steadyhand/operator/protocol/episodes.hpp"

#include <fmt/format.h>

namespace steadyhand {

Result<EpisodeMark> Episodes::take(EpisodeMark mark, std::optional<bool> decided) {
  using Kind = EpisodeMark::Kind;
  const Lock lock(mutex_);
  if (mark.kind == Kind::kBegin) {
    if (view_.running) {
      return Error{fmt::format("episode {} is running; keep or discard it first", view_.number)};
    }
    ++view_.number;
    view_.running = true;
    view_.success.reset();
    begin_ = mark.at;
  } else if (view_.number == 0) {
    return Error{fmt::format("there is no episode to {} yet; begin one first", to_string(mark.kind))};
  }
  const auto end = ends_.find(view_.number);
  if (end != ends_.end() && end->second == End::kLost) {
    return Error{
        fmt::format("episode {} is lost: its recording ended before it was kept; begin another", view_.number)};
  }
  mark.episode = view_.number;
  if (mark.kind == Kind::kKeep || mark.kind == Kind::kDiscard) {
    if (view_.running) view_.time = to_seconds(mark.at - begin_);
    if (view_.running && !mark.success && !view_.success) mark.success = decided;
    view_.running = false;
  }
  if (mark.success) view_.success = mark.success;
  return mark;
}

int& Episodes::count(End end) {
  return end == End::kKept ? view_.kept : end == End::kDiscarded ? view_.discarded : view_.lost;
}

bool Episodes::settle(const EpisodeOutcome& outcome, Time now) {
  using Kind = EpisodeMark::Kind;
  const Lock lock(mutex_);
  const auto settled = ends_.find(outcome.episode);
  // If a later mark is not recorded, the earlier one in the recording holds.
  if (outcome.recorded ? outcome.kind == Kind::kBegin || outcome.kind == Kind::kMark : settled != ends_.end()) {
    return false;
  }
  if (settled != ends_.end()) --count(settled->second);
  const End end = !outcome.recorded ? End::kLost : outcome.kind == Kind::kKeep ? End::kKept : End::kDiscarded;
  ends_[outcome.episode] = end;
  ++count(end);
  if (end == End::kLost && view_.running && outcome.episode == view_.number) {
    view_.running = false;
    view_.time = to_seconds(now - begin_);
  }
  return end == End::kLost;
}

EpisodeView Episodes::view(Time now) const {
  const Lock lock(mutex_);
  EpisodeView view = view_;
  if (view.running) view.time = to_seconds(now - begin_);
  return view;
}

}  // namespace steadyhand
