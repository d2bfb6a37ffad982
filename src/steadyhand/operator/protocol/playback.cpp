#include "steadyhand/operator/protocol/playback.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

/// From 0 to 1 with least jerk, at rest at both ends; it is fastest in the middle, by kLeastJerkPeak.
double least_jerk(double x) { return x * x * x * (10.0 + x * (6.0 * x - 15.0)); }
constexpr double kLeastJerkPeak = 1.875;

}  // namespace

std::vector<Pose> way_around_base(const Pose& from, const Pose& to) {
  constexpr double kSame = 0.005, kSameTurn = M_PI / 180.0, kNearAxis = 0.1, kShortest = 1.0;  // m, rad, m, s
  const double turn = from.q.angularDistance(to.q);
  if ((to.p - from.p).norm() < kSame && turn < kSameTurn) return {};
  const double r0 = from.p.head<2>().norm(), r1 = to.p.head<2>().norm();
  const double angle0 = std::atan2(from.p.y(), from.p.x());
  const double around = std::remainder(std::atan2(to.p.y(), to.p.x()) - angle0, 2.0 * M_PI);
  const bool straight = std::min(r0, r1) < kNearAxis;  // the angle means nothing there
  const double length =
      straight ? (to.p - from.p).norm() : std::hypot(r1 - r0, to.p.z() - from.p.z(), std::max(r0, r1) * around);
  const double duration =
      std::max({kShortest, kLeastJerkPeak * length / kWaySpeed, kLeastJerkPeak * turn / kWayTurnRate});
  std::vector<Pose> way(static_cast<std::size_t>(std::ceil(duration / to_seconds(Playback::kPeriod))) + 1);
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double share = least_jerk(static_cast<double>(i) / static_cast<double>(way.size() - 1));
    const double r = r0 + share * (r1 - r0), angle = angle0 + share * around;
    way[i].p = from.p + share * (to.p - from.p);
    if (!straight) way[i].p.head<2>() << r * std::cos(angle), r * std::sin(angle);
    way[i].q = from.q.slerp(share, to.q).normalized();
  }
  return way;
}

Playback::Playback(const Recording& recording, Time start, PerTool<std::vector<Pose>> ways)
    : recording_(&recording), start_(start) {
  const std::size_t count = recording.samples.size();
  for (int t = 0; t < kMaxTools; ++t) {
    const std::size_t first = sample_of(t, 0);
    if (first == count) continue;
    std::size_t last = first;
    for (std::size_t i = first; i < count; i = sample_of(t, i + 1)) last = i;
    longest_way_ = std::max(longest_way_, ways[t].size());
    hands_.push_back({t, std::move(ways[t]), first, last, first, start, {}});
  }
}

/// Index of the tool's first sample from there on; the recording's size: none.
std::size_t Playback::sample_of(int tool, std::size_t from) const {
  const auto& samples = recording_->samples;
  while (from < samples.size() && samples[from].tool != tool) ++from;
  return from;
}

Time Playback::closed_for(Time now, int tool) const {
  const auto hand = std::find_if(hands_.begin(), hands_.end(), [&](const Hand& each) { return each.tool == tool; });
  return hand != hands_.end() && hand->closed ? now - hand->closed_since : Time(0);
}

void Playback::grip_anew(Time now) {
  const auto any = [&](auto what) { return std::any_of(hands_.begin(), hands_.end(), what); };
  if (!any([](const Hand& hand) { return hand.closed; }) || any([&](const Hand& hand) { return waits(hand); })) return;
  const Time next = due();
  opens_until_ = now + kOpen;
  waits_until_ = opens_until_ + kWait;
  start_ += waits_until_ + kPeriod - next;  // the next sample comes then
  for (Hand& hand : hands_) {
    hand.emitted = now;
    hand.closed = false;
  }
}

/// A hand that the recording does not have from its beginning to its end stays before and after that.
bool Playback::from_recording(const Hand& hand) const {
  const auto& samples = recording_->samples;
  return !waits(hand) && hand.next < samples.size() &&
         hand.emitted >= moves() + samples[hand.first].stamp.hand - kPeriod;
}

Time Playback::due(const Hand& hand) const {
  return from_recording(hand) ? moves() + recording_->samples[hand.next].stamp.hand : hand.emitted + kPeriod;
}

Time Playback::due() const {
  Time earliest = Time::max();
  for (const Hand& hand : hands_) earliest = std::min(earliest, due(hand));
  return earliest;
}

bool Playback::next(Time now, OperatorSample& sample) {
  const auto hand =
      std::min_element(hands_.begin(), hands_.end(), [this](const Hand& a, const Hand& b) { return due(a) < due(b); });
  const Time due = this->due(*hand), ends = moves() + recording_->samples.back().stamp.hand + kReturn;
  if (due > now) return false;
  const bool recorded = from_recording(*hand), waiting = waits(*hand);
  sample = sample_at(due, *hand);
  if (recorded) hand->next = sample_of(hand->tool, hand->next + 1);
  hand->emitted = due;
  hand->at = sample.X_operator_hand;
  if (sample.clutch && !hand->closed) hand->closed_since = due;
  hand->closed = sample.clutch;
  hand->over = !waiting && due >= ends;
  if (std::all_of(hands_.begin(), hands_.end(), [](const Hand& each) { return each.over; })) end_round(due);
  return true;
}

/// One round: open, closed at the first pose (before it, in the first round, the way there), the recording, back to the
/// first pose.
OperatorSample Playback::sample_at(Time due, const Hand& hand) const {
  const auto& samples = recording_->samples;
  const bool recorded = from_recording(hand), moved = hand.next == samples.size();
  const Time returns = moves() + samples.back().stamp.hand;
  OperatorSample sample = samples[recorded ? hand.next : moved && due <= returns ? hand.last : hand.first];
  sample.stamp = {due, due};
  sample.leader = Leader::kRecording;
  if (waits(hand)) {  // it stays where it is, opens, and closes again
    sample.X_operator_hand = hand.at;
    sample.clutch = due >= opens_until_;
    return sample;
  }
  if (recorded) return sample;
  if (moved && due > returns) {
    const double share = least_jerk(std::min(1.0, to_seconds(due - returns) / to_seconds(kReturn)));
    const Pose& last = samples[hand.last].X_operator_hand;
    sample.X_operator_hand.p += (1.0 - share) * (last.p - sample.X_operator_hand.p);
    sample.X_operator_hand.q = last.q.slerp(share, sample.X_operator_hand.q);
  }
  if (due < moves() && !hand.way.empty()) {
    const auto passed = std::max(Time::rep(0), (due - leads()) / kPeriod);
    sample.X_operator_hand = hand.way[std::min<std::size_t>(passed, hand.way.size() - 1)];
  }
  sample.clutch = due >= start_ + kOpen && due < returns + kReturn;
  return sample;
}

void Playback::end_round(Time at) {
  start_ = at;
  longest_way_ = 0;
  ++rounds_;
  for (Hand& hand : hands_) {
    hand.next = hand.first;
    hand.way.clear();
    hand.over = false;
  }
}

}  // namespace steadyhand
