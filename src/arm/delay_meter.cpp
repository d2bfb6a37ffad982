#include "arm/delay_meter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

constexpr double kLongest = 0.7;      ///< s, that is looked for
constexpr double kResolution = 1e-4;  ///< s
/// Of the motion's range: what may be left between commands, a delay late, and what was measured.
constexpr double kUnexplained = 0.1;

}  // namespace

/// rad, RMS, between what was measured and what was told `delay` s before.
double DelayMeter::error(double delay) const {
  double sum = 0.0;
  int count = 0;
  std::size_t k = 0;
  for (const auto& [at, q] : measured_) {
    const Time then = at - from_seconds(delay);
    while (k + 1 < commands_.size() && commands_[k + 1].first <= then) ++k;
    if (then < commands_.front().first || k + 1 >= commands_.size()) continue;
    const auto& [begin, from] = commands_[k];
    const auto& [end, to] = commands_[k + 1];
    const double share = to_seconds(then - begin) / to_seconds(end - begin);
    const double difference = q - from - share * (to - from);
    sum += difference * difference;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : INFINITY;
}

Result<double> DelayMeter::delay() const {
  const Error undone{"the joint did not do what it was told"};
  if (commands_.size() < 2 || to_seconds(commands_.back().first - commands_.front().first) < kLongest) return undone;
  double best = 0.0, smallest = INFINITY;
  for (double step = 0.01; step > 0.5 * kResolution; step *= 0.1) {
    const double from = smallest == INFINITY ? 0.0 : std::max(0.0, best - 10.0 * step);
    const double to = smallest == INFINITY ? kLongest : best + 10.0 * step;
    for (double delay = from; delay < to; delay += step) {
      const double e = error(delay);
      if (e < smallest) smallest = e, best = delay;
    }
  }
  const auto [low, high] = std::minmax_element(commands_.begin(), commands_.end(),
                                               [](const auto& a, const auto& b) { return a.second < b.second; });
  if (!(smallest < kUnexplained * (high->second - low->second))) return undone;
  return best;
}

}  // namespace steadyhand
