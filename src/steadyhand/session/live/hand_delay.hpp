#pragma once

#include <algorithm>
#include <array>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// Adds latency for studies: a sample that passed the gate comes out `delay` later, with the same age as when it went
/// in. One thread; allocates nothing.
class HandDelay {
 public:
  static constexpr Time kLongest = std::chrono::seconds(1);

  /// Applies to samples that go in from now on. A change drops the samples inside. At most kLongest.
  void set(Time delay) {
    delay = std::clamp(delay, Time(0), kLongest);
    if (delay != delay_) clear();
    delay_ = delay;
  }
  void clear() { first_ = count_ = 0; }

  /// If there is no room, the oldest sample is dropped.
  void push(const OperatorSample& sample) {
    if (count_ == kRoom) drop();
    OperatorSample& last = samples_[(first_ + count_++) % kRoom];
    last = sample;
    last.stamp.hand += delay_;
    last.stamp.made += delay_;
  }
  /// The next sample that is due by `now`. Call it until it returns false.
  bool pop(Time now, OperatorSample& sample) {
    if (count_ == 0 || (delay_ > Time(0) && samples_[first_].stamp.made > now)) return false;
    sample = samples_[first_];
    drop();
    return true;
  }

 private:
  static constexpr std::size_t kRoom = 256;  ///< samples: as many as a client may send in kLongest
  void drop() {
    first_ = (first_ + 1) % kRoom;
    --count_;
  }

  std::array<OperatorSample, kRoom> samples_;
  std::size_t first_ = 0, count_ = 0;
  Time delay_{0};
};

}  // namespace steadyhand
