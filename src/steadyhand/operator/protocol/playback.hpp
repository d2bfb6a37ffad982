#pragma once

#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/files/input/recorded_hand.hpp"

namespace steadyhand {

/// Plays a recording as a live hand, or two, in a loop: engages, waits until the clutch's ramp is over, moves as
/// recorded, goes back to where it began, and releases. The arm ends each round where it began it. If the arm has
/// disengaged, all hands open, wait, engage again and continue. Allocates nothing after it was made.
class Playback {
 public:
  static constexpr Time kPeriod = std::chrono::milliseconds(11);  ///< between samples that are not from the recording

  /// The recording must outlive it. @param start of the first round, session's clock @param ways of each tool's hand
  /// the poses, a kPeriod apart, that it goes through in the first round before it moves as recorded; the last one is
  /// its first in the recording. Empty: it begins there.
  Playback(const Recording& recording, Time start, PerTool<std::vector<Pose>> ways = {});

  /// The next sample of any hand if its time has come by `now`: call until false. Stamped with the session's time.
  bool next(Time now, OperatorSample& sample);
  /// When the next sample's time comes.
  Time due() const;
  std::uint64_t rounds() const { return rounds_; }
  /// For how long a tool's hand has been closed without a break; 0: it is open, or the recording has none.
  Time closed_for(Time now, int tool = 0) const;
  /// All hands release, engage where they are now, and continue from there.
  void grip_anew(Time now);

 private:
  struct Hand {
    int tool = 0;
    std::vector<Pose> way;
    std::size_t first = 0, last = 0;  ///< of its samples in the recording
    std::size_t next = 0;             ///< of its samples; the recording's size: none
    Time emitted{0};                  ///< stamp of the last sample
    Pose at;                          ///< pose in the last sample
    bool closed = false;              ///< clutch in the last sample
    Time closed_since{0};
    bool over = false;  ///< this round is
  };

  Time leads() const { return start_ + kOpen + kWait; }
  Time moves() const { return leads() + static_cast<Time::rep>(longest_way_) * kPeriod; }
  bool waits(const Hand& hand) const { return hand.emitted < waits_until_; }
  bool from_recording(const Hand& hand) const;
  Time due(const Hand& hand) const;
  std::size_t sample_of(int tool, std::size_t from) const;
  OperatorSample sample_at(Time due, const Hand& hand) const;
  void end_round(Time at);

  static constexpr Time kOpen = std::chrono::milliseconds(400), kWait = std::chrono::milliseconds(600),
                        kReturn = std::chrono::milliseconds(2000);

  const Recording* recording_;
  std::vector<Hand> hands_;      ///< that the recording has
  std::size_t longest_way_ = 0;  ///< in this round
  Time start_;                   ///< start of this round
  std::uint64_t rounds_ = 0;
  Time opens_until_{0}, waits_until_{0};  ///< while they engage again
};

/// Poses of the tool, Playback::kPeriod apart, from one to another: around the base's z axis, where an arm has room,
/// with least jerk and at no more than about kWaySpeed and kWayTurnRate. Empty if both are the same within 5 mm and a
/// degree.
std::vector<Pose> way_around_base(const Pose& X_base_from, const Pose& X_base_to);

inline constexpr double kWaySpeed = 0.4;     ///< m/s
inline constexpr double kWayTurnRate = 1.0;  ///< rad/s

}  // namespace steadyhand
