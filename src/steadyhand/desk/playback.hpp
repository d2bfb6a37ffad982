#pragma once

#include "steadyhand/input/recorded_hand.hpp"

namespace steadyhand {

/// Plays a recording as a live hand, over and over: grips, waits until the clutch's ramp is over, moves as recorded,
/// goes back to where it began, and lets go. So the arm ends each round where it began it. Allocates nothing.
class Playback {
 public:
  /// The recording must outlive it. @param start of the first round, session's clock
  Playback(const Recording& recording, Time start) : recording_(&recording), start_(start), emitted_(start) {}

  /// The next sample if its time has come by `now`: call until false. Stamped with the session's time.
  bool next(Time now, OperatorSample& sample);
  /// When the next sample's time comes.
  Time due() const;
  std::uint64_t rounds() const { return rounds_; }

 private:
  Time moves() const { return start_ + kOpen + kWait; }
  bool from_recording() const { return emitted_ >= moves() - kPeriod && next_sample_ < recording_->samples.size(); }

  static constexpr Time kPeriod = std::chrono::milliseconds(11);  ///< of samples that are not of the recording
  static constexpr Time kOpen = std::chrono::milliseconds(400), kWait = std::chrono::milliseconds(600),
                        kReturn = std::chrono::milliseconds(2000);

  const Recording* recording_;
  Time start_;    ///< of this round
  Time emitted_;  ///< stamp of the last sample
  std::size_t next_sample_ = 0;
  std::uint64_t rounds_ = 0;
};

}  // namespace steadyhand
