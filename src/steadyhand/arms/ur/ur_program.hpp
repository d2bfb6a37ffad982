#pragma once

#include <array>
#include <string>
#include <string_view>

#include "steadyhand/arms/driver/ur_settings.hpp"
#include "steadyhand/core/math.hpp"

namespace steadyhand {

/// Registers that program and computer share: the upper half, which the RTDE guide leaves to external clients.
struct UrRegisters {
  static constexpr int kFirst = 24;
  // double inputs, six each: set-point
  static constexpr int kQ = kFirst, kDq = kFirst + 6, kDdq = kFirst + 12;
  // integer inputs: cycle of the program that the set-point answers to; 1 follow or 0 stop; session of the set-points
  static constexpr int kAnswers = kFirst, kMode = kFirst + 1, kSession = kFirst + 2;
  // integer outputs: UrProgramState; the program's cycle; the program's session
  static constexpr int kState = kFirst, kCycle = kFirst + 1, kOwner = kFirst + 2;
};

/// State of the program on the controller, in output register kState. Negative: it has ended.
enum class UrProgramState : int {
  kNone = 0,
  kReady = 1,      ///< stationary, waits for the first set-point
  kFollowing = 2,  ///< also while it bridges lost set-points or returns to them
  kAsked = -1,     ///< ended by a stop command
  kSilence = -2,   ///< ended since set-points stopped coming
  kTooFast = -3,   ///< ended since a set-point stepped
  kTooFar = -4,    ///< ended since set-points were too far from its position
  kMoved = -5,     ///< ended since the arm had stopped or moved without it: the program was paused, and resumed
};

/// The URScript program that follows set-points in the registers with servoj, one a control cycle, and ends by itself.
/// It knows a set-point's age from its own cycle's number, which comes back with the set-point. Beyond the smallest age
/// seen so far, it extrapolates the set-point's motion (q + dq t + ddq t^2 / 2). A paused program continues with its
/// old values when it is resumed: so it checks the controller's own target and ends if that did not follow it. Sums of
/// lists require software 3.14.3 or 5.9.4. @pre velocity_max and acceleration_max have six entries
std::string make_ur_program(const UrProgramSettings& settings);

/// The text of the program to send, with a new session number each time.
class UrProgramText {
 public:
  explicit UrProgramText(UrProgramSettings settings);

  int session() const { return session_; }
  /// Takes an unused session number, larger than the present one and `newest`. Allocates nothing.
  void renew(int newest);
  std::string_view text() const { return text_; }

 private:
  int session_;
  std::string text_;
  std::array<std::size_t, 2> session_at_{};  ///< positions of the session's number in the text
};

/// Ends the program that the controller runs.
inline constexpr std::string_view kUrStopProgram = "stop program\n";

}  // namespace steadyhand
