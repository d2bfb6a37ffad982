#pragma once

#include <optional>
#include <string_view>

#include "steadyhand/session/supervise/supervision.hpp"

namespace steadyhand {

/// Result of checking one sample of the hand.
enum class HandVerdict {
  kGood,
  kUntracked,    ///< the device has no pose
  kEmulated,     ///< the device guesses the position
  kNotFinite,    ///< numbers that are not finite, or an invalid quaternion
  kJump,         ///< faster than a hand can move
  kFarAway,      ///< after a loss: too far from where it was lost; a new grip is needed
  kUnsettled,    ///< after a loss: near, but not yet for long enough
  kOutOfOrder,   ///< not newer than the one before; dropped
  kStale,        ///< too old on arrival; dropped
  kClockStepped  ///< the stamps went back or ahead so far that the clock must have been set; dropped
};
/// Text for people.
std::string_view to_string(HandVerdict verdict, Leader leader = Leader::kPerson);

/// What the gate knows about the hand after a sample.
struct HandReport {
  Time received{0};                          ///< when the last sample of any kind arrived
  Time good{0};                              ///< when the last good one arrived
  bool clutch = false;                       ///< closed by the last sample in order, in a valid grip
  bool trusted = false;                      ///< its pose may be followed
  HandVerdict verdict = HandVerdict::kGood;  ///< why not
  std::uint64_t grips = 0;                   ///< how often the clutch was seen to close, each after it was seen open
  std::optional<double> gripper{};           ///< 0 open to 1 closed, of the last good sample that contained it
  Time gripper_said{0};                      ///< when that sample arrived
  Leader leader = Leader::kPerson;           ///< the leader in the last sample
  bool settings_wait = false;                ///< it is not followed until the operator's settings are in force
};

/// Checks every sample of the operator's device: only poses that a hand can have pass. A pose that is guessed, far from
/// the last, or not newer than it is treated as none: following it would be a valid motion to a wrong place. After a
/// loss the hand is trusted again near where it was lost, or after a new grip. Allocates nothing; one thread.
class HandGate {
 public:
  explicit HandGate(const HandGateSettings& settings = {}) : settings_(settings) {}

  /// Call it for every sample as it arrives. @param now the session's clock
  HandVerdict update(const OperatorSample& sample, Time now);
  /// The device has gone: the next samples must open the clutch before they close it.
  void forget();

  const HandReport& report() const { return report_; }
  std::uint64_t dropped() const { return dropped_; }  ///< samples that were out of order or too old

 private:
  HandVerdict judge_pose(const OperatorSample& sample);

  HandGateSettings settings_;
  HandReport report_;
  bool any_ = false;        ///< last_ is set
  bool opened_ = false;     ///< the clutch was seen open since forget() and the last grip
  bool gripped_ = false;    ///< it closed after that, and has stayed closed
  bool lost_ = false;       ///< the pose went bad while the clutch was closed
  OperatorSample last_;     ///< the last in order, with any verdict
  OperatorSample trusted_;  ///< last good one
  int settled_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace steadyhand
