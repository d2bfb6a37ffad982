#include "steadyhand/desk/episodes.hpp"

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
    was_kept_.reset();
    begin_ = mark.at;
  } else if (view_.number == 0) {
    return Error{fmt::format("there is no episode to {} yet; begin one first", to_string(mark.kind))};
  }
  mark.episode = view_.number;
  if (mark.kind == Kind::kKeep || mark.kind == Kind::kDiscard) {
    if (view_.running) view_.time = to_seconds(mark.at - begin_);
    if (view_.running && !mark.success && !view_.success) mark.success = decided;
    view_.running = false;
    const bool keeps = mark.kind == Kind::kKeep;
    if (was_kept_) --(*was_kept_ ? view_.kept : view_.discarded);  // thought better of
    ++(keeps ? view_.kept : view_.discarded);
    was_kept_ = keeps;
  }
  if (mark.success) view_.success = mark.success;
  return mark;
}

EpisodeView Episodes::view(Time now) const {
  const Lock lock(mutex_);
  EpisodeView view = view_;
  if (view.running) view.time = to_seconds(now - begin_);
  return view;
}

}  // namespace steadyhand
