#pragma once

#include "steadyhand/input/recorded_hand.hpp"

namespace steadyhand {

/// Plays a recording as a live hand, over and over: grips, waits until the clutch's ramp is over, moves as recorded,
/// goes back to where it began, and lets go. So the arm ends each round where it began it. Where the grip was lost it
/// waits, grips anew and goes on. Allocates nothing.
class Playback {
 public:
  /// The recording must outlive it. @param start of the first round, session's clock
  Playback(const Recording& recording, Time start) : recording_(&recording), start_(start), emitted_(start) {}

  /// The next sample if its time has come by `now`: call until false. Stamped with the session's time.
  bool next(Time now, OperatorSample& sample);
  /// When the next sample's time comes.
  Time due() const;
  std::uint64_t rounds() const { return rounds_; }
  /// For how long the hand has been closed without a break; 0: it is open.
  Time closed_for(Time now) const { return closed_ ? now - closed_since_ : Time(0); }
  /// Lets go and grips where it is now, and leads on from there.
  void grip_anew(Time now);

 private:
  Time moves() const { return start_ + kOpen + kWait; }
  bool waits() const { return emitted_ < waits_until_; }
  bool from_recording() const {
    return !waits() && emitted_ >= moves() - kPeriod && next_sample_ < recording_->samples.size();
  }

  bool hold(Time due, OperatorSample& sample);
  void note(const OperatorSample& sample);

  static constexpr Time kPeriod = std::chrono::milliseconds(11);  ///< of samples that are not of the recording
  static constexpr Time kOpen = std::chrono::milliseconds(400), kWait = std::chrono::milliseconds(600),
                        kReturn = std::chrono::milliseconds(2000);

  const Recording* recording_;
  Time start_;    ///< of this round
  Time emitted_;  ///< stamp of the last sample
  std::size_t next_sample_ = 0;
  std::uint64_t rounds_ = 0;
  Pose last_;            ///< of the last sample
  bool closed_ = false;  ///< in it
  Time closed_since_{0};
  Time opens_until_{0}, waits_until_{0};  ///< of a grip that is made anew
};

}  // namespace steadyhand
