#include "steadyhand/core/histogram.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

void Histogram::add(double us) {
  const double octaves = std::log2(std::max(us, 1.0));
  auto& bin = bins_[std::clamp(static_cast<int>(octaves * kPerOctave), 0, kBins - 1)];
  bin.store(bin.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  count_.store(count_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  if (us > max_.load(std::memory_order_relaxed)) max_.store(us, std::memory_order_relaxed);
}

double Histogram::percentile(double share) const {
  std::uint64_t total = 0;
  std::array<std::uint64_t, kBins> bins;
  for (int i = 0; i < kBins; ++i) total += bins[i] = bins_[i].load(std::memory_order_relaxed);
  if (total == 0) return 0.0;
  std::uint64_t below = 0;
  for (int i = 0; i < kBins; ++i) {
    below += bins[i];
    if (static_cast<double>(below) >= share * static_cast<double>(total)) {
      return std::min(std::exp2(static_cast<double>(i + 1) / kPerOctave), max());
    }
  }
  return max();
}

TimingSummary Histogram::summary() const { return {percentile(0.5), percentile(0.99), percentile(0.999), max()}; }

}  // namespace steadyhand
