#pragma once

#include <algorithm>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// From another computer's clock to ours, out of messages that come late by a changing amount and never early: the
/// smallest difference of the last seconds. It changes by 1e-4 of the time passed at most, so that commands sampled in
/// that time keep their speed. Allocates nothing.
class OffsetFilter {
 public:
  /// Forgets; the next message counts as it is.
  void reset() { *this = OffsetFilter(); }

  /// @param theirs stamp of a message on their clock, later than the last one's @param ours when it came, on ours
  /// @param at_once the estimate may jump: nothing needs it to be smooth now
  /// @return their stamp on our clock
  Time update(Time theirs, Time ours, bool at_once) {
    const Time difference = ours - theirs;
    if (!any_) {
      offset_ = block_ = before_ = difference;
      block_began_ = theirs;
    } else if (theirs - block_began_ > kBlock) {
      before_ = std::min(block_, difference);
      block_ = difference;
      block_began_ = theirs;
    }
    block_ = std::min(block_, difference);
    const Time estimate = std::min(block_, before_);
    const Time most = at_once || !any_ ? Time::max() : (theirs - last_) / 10000;
    offset_ = std::clamp(estimate, most == Time::max() ? estimate : offset_ - most,
                         most == Time::max() ? estimate : offset_ + most);
    last_ = theirs;
    any_ = true;
    return theirs + offset_;
  }

 private:
  static constexpr Time kBlock = std::chrono::seconds(2);
  bool any_ = false;
  Time offset_{0}, block_{0}, before_{0}, block_began_{0}, last_{0};
};

}  // namespace steadyhand
