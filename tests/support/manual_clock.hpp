#pragma once

#include <algorithm>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Time that passes only if a caller sleeps or a test advances it.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(Time start = std::chrono::seconds(100)) : now_(start) {}
  Time now() const override { return now_; }
  void sleep_until(Time deadline) override { now_ = std::max(now_, deadline); }
  void advance(double seconds) { now_ += from_seconds(seconds); }

 private:
  Time now_;
};

}  // namespace steadyhand
