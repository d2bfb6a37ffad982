#include "steadyhand/arms/ur/ur_link_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace steadyhand {

void UrLinkMeter::package(Time arrival, double stamp, std::int32_t echo) {
  if (!std::isfinite(stamp) || std::abs(stamp) > 1e9) return;
  if (report_.packages++ == 0) {
    first_ = arrival;
  } else {
    const Time passed = from_seconds(stamp - last_stamp_);
    const auto cycles = (passed + period_ / 2) / period_;
    if (cycles > 1) report_.skipped += static_cast<std::uint64_t>(cycles - 1);
    report_.longest_gap = std::max(report_.longest_gap, 1e-3 * static_cast<double>((arrival - last_).count()));
  }
  const Time due = earliest_.update(from_seconds(stamp), arrival, true);
  late_.add(1e-3 * static_cast<double>((arrival - due).count()));
  last_ = arrival;
  last_stamp_ = stamp;
  if (echo > seen_ && echo <= sent_ && sent_ - echo < kInFlight) {
    seen_ = echo;
    ++report_.echoes;
    round_trip_.add(1e-3 * static_cast<double>((arrival - sent_at_[echo % kInFlight]).count()));
  }
}

std::int32_t UrLinkMeter::send(Time now) {
  ++sent_;
  sent_at_[sent_ % kInFlight] = now;
  return sent_;
}

UrLinkReport UrLinkMeter::report() const {
  UrLinkReport report = report_;
  report.seconds = to_seconds(last_ - first_);
  report.late = late_.summary();
  report.round_trip = round_trip_.summary();
  report.wake = wake_.summary();
  return report;
}

UrLinkJudgement judge(const UrLinkReport& r, int bridged, double timeout) {
  UrLinkJudgement j;
  const double period = 1e6 / r.rate_hz, bridge = bridged * period, stop = 1e6 * timeout;
  // How much later than usual a set-point may come: a round trip, beyond the shortest.
  const double usual = r.round_trip.p50;
  const double worst = std::max(r.round_trip.max - usual, r.longest_gap - period);
  const double rare = r.round_trip.p999 - usual;
  j.verdict = worst <= bridge                        ? UrLinkVerdict::kFit
              : rare <= bridge && worst < 0.5 * stop ? UrLinkVerdict::kFitWithCare
                                                     : UrLinkVerdict::kUnfit;
  if (r.packages == 0 || r.echoes == 0) {
    j.verdict = UrLinkVerdict::kUnfit;
    j.findings.push_back("the controller does not return its registers unchanged: does another program write them?");
    return j;
  }
  const auto say = [&](std::string line) { j.findings.push_back(std::move(line)); };
  if (worst >= 0.5 * stop) {
    say(fmt::format("the longest delay, {:.1f} ms, is close to the {:.0f} ms after which the arm stops by itself",
                    1e-3 * worst, 1e-3 * stop));
  }
  if (r.wake.p999 > 0.25 * period || r.wake.max > bridge) {
    say(fmt::format(
        "this machine wakes up to {:.1f} ms late: allow real-time priority (rtprio and memlock in "
        "/etc/security/limits.conf), set the processor to performance, end other work; a PREEMPT_RT kernel is best",
        1e-3 * r.wake.max));
  }
  if (r.retransmitted > 0) {
    say(fmt::format(
        "{} packets were lost on the way and sent again: use a cable, not Wi-Fi; change the cable or the switch port",
        r.retransmitted));
  }
  if (usual > 2.5 * period) {
    say(fmt::format(
        "a round trip usually takes {:.1f} ms, {:.1f} cycles: connect the controller directly or through one switch",
        1e-3 * usual, usual / period));
  }
  if (j.verdict != UrLinkVerdict::kFit && r.wake.max < 0.25 * (worst + 1.0) && r.retransmitted == 0) {
    say("the delays come from the network or the controller: take other traffic off the cable (cameras, file servers)");
  }
  if (static_cast<double>(r.skipped) > 1e-3 * static_cast<double>(r.packages)) {
    say(fmt::format("the controller left out {} of {} states: it is busy; end other RTDE clients and URCaps", r.skipped,
                    r.packages + r.skipped));
  }
  return j;
}

}  // namespace steadyhand
