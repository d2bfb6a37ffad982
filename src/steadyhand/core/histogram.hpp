#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "steadyhand/core/describe.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

template <typename V>
void describe(V& v, TimingSummary& t) {
  v.type("Timing", "Percentiles of the last seconds.");
  v.add("p50", "us", "median", t.p50, kOrNull);
  v.add("p99", "us", "", t.p99, kOrNull);
  v.add("p999", "us", "", t.p999, kOrNull);
  v.add("max", "us", "", t.max, kOrNull);
}

/// Counts durations in bins of 3 % width from 1 us to over an hour. One thread adds; any thread may read meanwhile.
/// Allocates nothing.
class Histogram {
 public:
  void add(double us);

  std::uint64_t count() const { return count_.load(std::memory_order_relaxed); }
  double max() const { return max_.load(std::memory_order_relaxed); }  ///< us
  /// The smallest duration that a share of all counted ones does not exceed, to the width of a bin, us; 0 without any.
  double percentile(double share) const;
  TimingSummary summary() const;

 private:
  static constexpr int kPerOctave = 24, kBins = 32 * kPerOctave;
  std::array<std::atomic<std::uint64_t>, kBins> bins_{};
  std::atomic<std::uint64_t> count_{0};
  std::atomic<double> max_{0.0};
};

}  // namespace steadyhand
