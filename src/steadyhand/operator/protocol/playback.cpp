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

void Playback::grip_anew(Time now) {
  if (!closed_ || waits()) return;
  const Time next = due();
  opens_until_ = now + kOpen;
  waits_until_ = opens_until_ + kWait;
  start_ += waits_until_ + kPeriod - next;  // the next sample comes then
  emitted_ = now;
  closed_ = false;
}

/// One round: open, closed at the first pose (before it, in the first round, the way there), the recording, back to the
/// first pose.
Time Playback::due() const {
  return from_recording() ? moves() + recording_->samples[next_sample_].stamp.hand : emitted_ + kPeriod;
}

bool Playback::next(Time now, OperatorSample& sample) {
  const auto& samples = recording_->samples;
  const bool recorded = from_recording(), waiting = waits();
  const Time due = this->due(), returns = moves() + samples.back().stamp.hand, ends = returns + kReturn;
  if (due > now) return false;
  emitted_ = due;
  if (waiting) return hold(due, sample);
  sample = recorded ? samples[next_sample_++] : samples.front();
  sample.stamp = {due, due};
  sample.leader = Leader::kRecording;
  if (!recorded && due > returns) {
    const double x = std::min(1.0, to_seconds(due - returns) / to_seconds(kReturn));
    const double share = least_jerk(x);
    const Pose& last = samples.back().X_operator_hand;
    sample.X_operator_hand.p += (1.0 - share) * (last.p - sample.X_operator_hand.p);
    sample.X_operator_hand.q = last.q.slerp(share, sample.X_operator_hand.q);
  }
  if (due < moves() && !way_.empty()) {
    const auto passed = std::max(Time::rep(0), (due - leads()) / kPeriod);
    sample.X_operator_hand = way_[std::min<std::size_t>(passed, way_.size() - 1)];
  }
  if (!recorded) sample.clutch = due >= start_ + kOpen && due < ends;
  if (due >= ends) {
    start_ = due;
    next_sample_ = 0;
    way_.clear();
    ++rounds_;
  }
  note(sample);
  return true;
}

/// The hand stays where it is, opens, and closes again.
bool Playback::hold(Time due, OperatorSample& sample) {
  sample = recording_->samples.front();
  sample.X_operator_hand = last_;
  sample.stamp = {due, due};
  sample.leader = Leader::kRecording;
  sample.clutch = due >= opens_until_;
  note(sample);
  return true;
}

void Playback::note(const OperatorSample& sample) {
  last_ = sample.X_operator_hand;
  if (sample.clutch && !closed_) closed_since_ = sample.stamp.made;
  closed_ = sample.clutch;
}

}  // namespace steadyhand
