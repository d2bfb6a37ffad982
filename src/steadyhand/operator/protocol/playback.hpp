#pragma once

#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/files/input/recorded_hand.hpp"

namespace steadyhand {

/// Plays a recording as a live hand in a loop: engages, waits until the clutch's ramp is over, moves as recorded, goes
/// back to where it began, and releases. The arm ends each round where it began it. If the arm has disengaged, it
/// waits, engages again and continues. Allocates nothing.
class Playback {
 public:
  static constexpr Time kPeriod = std::chrono::milliseconds(11);  ///< between samples that are not from the recording

  /// The recording must outlive it. @param start of the first round, session's clock @param way poses of the hand, a
  /// kPeriod apart, that it goes through in the first round before it moves as recorded; the last one is the
  /// recording's first. Empty: it begins there.
  Playback(const Recording& recording, Time start, std::vector<Pose> way = {})
      : recording_(&recording), way_(std::move(way)), start_(start), emitted_(start) {}

  /// The next sample if its time has come by `now`: call until false. Stamped with the session's time.
  bool next(Time now, OperatorSample& sample);
  /// When the next sample's time comes.
  Time due() const;
  std::uint64_t rounds() const { return rounds_; }
  /// For how long the hand has been closed without a break; 0: it is open.
  Time closed_for(Time now) const { return closed_ ? now - closed_since_ : Time(0); }
  /// Releases, engages where it is now, and continues from there.
  void grip_anew(Time now);

 private:
  Time leads() const { return start_ + kOpen + kWait; }
  Time moves() const { return leads() + static_cast<Time::rep>(way_.size()) * kPeriod; }
  bool waits() const { return emitted_ < waits_until_; }
  bool from_recording() const {
    return !waits() && emitted_ >= moves() - kPeriod && next_sample_ < recording_->samples.size();
  }

  bool hold(Time due, OperatorSample& sample);
  void note(const OperatorSample& sample);

  static constexpr Time kOpen = std::chrono::milliseconds(400), kWait = std::chrono::milliseconds(600),
                        kReturn = std::chrono::milliseconds(2000);

  const Recording* recording_;
  std::vector<Pose> way_;
  Time start_;    ///< start of this round
  Time emitted_;  ///< stamp of the last sample
  std::size_t next_sample_ = 0;
  std::uint64_t rounds_ = 0;
  Pose last_;            ///< pose in the last sample
  bool closed_ = false;  ///< clutch in the last sample
  Time closed_since_{0};
  Time opens_until_{0}, waits_until_{0};  ///< while it engages again
};

/// Poses of the tool, Playback::kPeriod apart, from one to another: around the base's z axis, where an arm has room,
/// with least jerk and at no more than about kWaySpeed and kWayTurnRate. Empty if both are the same within 5 mm and a
/// degree.
std::vector<Pose> way_around_base(const Pose& X_base_from, const Pose& X_base_to);

inline constexpr double kWaySpeed = 0.4;     ///< m/s
inline constexpr double kWayTurnRate = 1.0;  ///< rad/s

}  // namespace steadyhand
