#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "steadyhand/arms/driver/offset_filter.hpp"
#include "steadyhand/core/histogram.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Quality of a connection to a controller over a period. Times in us.
struct UrLinkReport {
  double seconds = 0.0, rate_hz = 500.0;
  std::uint64_t packages = 0;
  std::uint64_t skipped = 0;        ///< cycles for which the controller sent nothing: it was too busy
  std::uint64_t echoes = 0;         ///< round trips measured
  TimingSummary late;               ///< delay of states' arrival, compared with the earliest
  TimingSummary round_trip;         ///< from sending a number to seeing the controller report it
  TimingSummary wake;               ///< how late this machine wakes from a sleep
  double longest_gap = 0.0;         ///< between two arrivals
  std::uint64_t retransmitted = 0;  ///< TCP segments of ours that had to be sent again
};

enum class UrLinkVerdict { kFit, kFitWithCare, kUnfit };

struct UrLinkJudgement {
  UrLinkVerdict verdict = UrLinkVerdict::kUnfit;
  std::vector<std::string> findings;  ///< what is wrong, and what to change, most important first
};

/// Fit: set-points never come later than the program on the controller bridges (two cycles). Fit with care: rarely
/// later, and never so late that it stops. @param bridged, timeout see UrProgramSettings
UrLinkJudgement judge(const UrLinkReport& report, int bridged, double timeout);

/// Collects the report, a package at a time: its arrival, the controller's stamp, and the number that came back. One
/// thread.
class UrLinkMeter {
 public:
  explicit UrLinkMeter(double rate_hz) : period_(from_seconds(1.0 / rate_hz)) { report_.rate_hz = rate_hz; }

  /// @param stamp s, the controller's @param echo number that it holds now
  void package(Time arrival, double stamp, std::int32_t echo);
  /// The number to send next; call when it was sent.
  std::int32_t send(Time now);
  void woke(Time late) { wake_.add(1e-3 * static_cast<double>(late.count())); }
  /// @pre some packages came
  UrLinkReport report() const;

 private:
  static constexpr int kInFlight = 1024;
  Time period_;
  UrLinkReport report_;
  Histogram late_, round_trip_, wake_;
  Time first_{0}, last_{0};
  OffsetFilter earliest_;
  double last_stamp_ = 0.0;
  std::int32_t sent_ = 0, seen_ = 0;
  std::vector<Time> sent_at_ = std::vector<Time>(kInFlight);
};

}  // namespace steadyhand
