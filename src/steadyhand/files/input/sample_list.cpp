#include "steadyhand/files/input/sample_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace steadyhand {
namespace {

constexpr double kMaxDistance = 100.0;    // m, from the room's origin: more is a wrong unit or a broken file
constexpr double kMaxDuration = 86400.0;  // s
constexpr double kNormTolerance = 1e-3;
constexpr double kSlowest = 2.0;  // s between samples, in the middle of all: no device is so slow

/// s, of the distances in time of the samples of each hand.
double median_period(const std::vector<OperatorSample>& samples) {
  std::vector<Time> periods;
  PerTool<const OperatorSample*> before{};
  for (const OperatorSample& sample : samples) {
    const OperatorSample* last = std::exchange(before[sample.tool], &sample);
    if (last) periods.push_back(sample.stamp.hand - last->stamp.hand);
  }
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return to_seconds(*middle);
}

}  // namespace

Status SampleList::add(const Row& row, const std::string& where, int tool) {
  Hand& hand = hands_[tool];
  if (!std::isfinite(row.t) || !row.p.allFinite() || !row.q.coeffs().allFinite()) {
    return Error{fmt::format("{}: time, position and orientation must be finite numbers", where)};
  }
  if (samples_.empty()) start_ = row.t;
  if (hand.count > 0 && row.t < hand.previous) {
    return Error{
        fmt::format("{}: time goes backwards, from {} s to {} s; it must increase", where, hand.previous, row.t)};
  }
  if (std::abs(row.t - start_) > kMaxDuration) {
    return Error{fmt::format(
        "{}: time {} s is {} s after the first sample; at most {} s (a day) can be replayed. Is it in other units?",
        where, row.t, row.t - start_, kMaxDuration)};
  }
  const Time time = from_seconds(row.t - start_);
  if (hand.count > 0 && time == hand.newest) {
    return Error{fmt::format("{}: time {} s repeats that of the sample before; it must increase", where, row.t)};
  }
  const double distance = row.p.norm();
  if (distance > kMaxDistance) {
    return Error{fmt::format(
        "{}: position [{}, {}, {}] m is {} m from the origin; it must be within {} m. Is it in other units?", where,
        row.p.x(), row.p.y(), row.p.z(), distance, kMaxDistance)};
  }
  const double norm = row.q.norm();
  if (std::abs(norm - 1.0) > kNormTolerance) {
    return Error{fmt::format("{}: quaternion [{}, {}, {}, {}] has norm {}; it must be 1 to within {}", where, row.q.x(),
                             row.q.y(), row.q.z(), row.q.w(), norm, kNormTolerance)};
  }

  OperatorSample sample;
  sample.stamp = {time, time};
  sample.X_operator_hand = {row.p, row.q.normalized()};
  sample.clutch = row.clutch;
  sample.tool = tool;
  samples_.push_back(sample);
  hand = {hand.count + 1, row.t, time};
  return Done{};
}

Result<std::vector<OperatorSample>> SampleList::take(double from, double until, const std::string& where) && {
  const std::size_t read = samples_.size();
  if (read < 2) {
    return Error{fmt::format("{}: holds {} sample{}; a recording needs at least 2", where, read, read == 1 ? "" : "s")};
  }
  for (int t = 0; t < kMaxTools; ++t) {
    if (hands_[t].count != 1) continue;
    return Error{fmt::format("{}: the hand that moves tool {} has 1 sample; it needs at least 2", where, t)};
  }
  if (const double period = median_period(samples_); period > kSlowest) {
    return Error{fmt::format(
        "{}: its samples are {:g} s apart; a hand is recorded many times a second. Are its times in ms? They "
        "must be in s",
        where, period)};
  }
  std::ranges::stable_sort(samples_, {},
                           [](const OperatorSample& sample) { return std::pair(sample.stamp.hand, sample.tool); });
  const Time earliest = samples_.front().stamp.hand;
  for (OperatorSample& sample : samples_) sample.stamp.hand = sample.stamp.made = sample.stamp.hand - earliest;
  const double end = to_seconds(samples_.back().stamp.hand);
  std::erase_if(samples_, [&](const OperatorSample& sample) {
    const double t = to_seconds(sample.stamp.hand);
    return t < from || t > until;
  });
  if (samples_.size() < 2) {
    return Error{fmt::format("{}: {} of its samples lie{} from {} s to {} s; at least 2 must. The recording lasts {} s",
                             where, samples_.size(), samples_.size() == 1 ? "s" : "", from, until, end)};
  }
  const Time first = samples_.front().stamp.hand;
  for (OperatorSample& sample : samples_) {
    sample.stamp.hand -= first;
    sample.stamp.made -= first;
  }
  return std::move(samples_);
}

}  // namespace steadyhand
