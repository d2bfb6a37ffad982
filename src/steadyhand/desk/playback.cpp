#include "steadyhand/desk/playback.hpp"

#include <algorithm>

namespace steadyhand {

void Playback::grip_anew(Time now) {
  if (!closed_ || waits()) return;
  const Time next = due();
  opens_until_ = now + kOpen;
  waits_until_ = opens_until_ + kWait;
  start_ += waits_until_ + kPeriod - next;  // what would have come next comes then
  emitted_ = now;
  closed_ = false;
}

/// One round: open, closed at the first pose, the recording, back to the first pose.
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
    const double share = x * x * x * (10.0 + x * (6.0 * x - 15.0));  // least jerk
    const Pose& last = samples.back().X_operator_hand;
    sample.X_operator_hand.p += (1.0 - share) * (last.p - sample.X_operator_hand.p);
    sample.X_operator_hand.q = last.q.slerp(share, sample.X_operator_hand.q);
  }
  if (!recorded) sample.clutch = due >= start_ + kOpen && due < ends;
  if (due >= ends) {
    start_ = due;
    next_sample_ = 0;
    ++rounds_;
  }
  note(sample);
  return true;
}

/// The hand stays where it was, opens, and closes again.
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
