#pragma once

#include <string>

#include "steadyhand/core/math.hpp"

namespace steadyhand {

/// Registers that program and computer share: the upper half, which the RTDE guide leaves to external clients.
struct UrRegisters {
  static constexpr int kFirst = 24;
  // double inputs, six each: set-point
  static constexpr int kQ = kFirst, kDq = kFirst + 6, kDdq = kFirst + 12;
  // integer inputs: cycle of the program that the set-point answers to; 1 follow or 0 stop; whose set-points these are
  static constexpr int kAnswers = kFirst, kMode = kFirst + 1, kSession = kFirst + 2;
  // integer outputs: UrProgramState; the program's cycle; whose program this is
  static constexpr int kState = kFirst, kCycle = kFirst + 1, kOwner = kFirst + 2;
};

/// What the program on the controller reports of itself in output register kState. Negative: it has ended.
enum class UrProgramState : int {
  kNone = 0,
  kReady = 1,      ///< stands, waits for the first set-point
  kFollowing = 2,  ///< also while it bridges lost set-points or returns to them
  kAsked = -1,     ///< ended since it was told to
  kSilence = -2,   ///< ended since set-points stopped coming
  kTooFast = -3,   ///< ended since a set-point stepped
  kTooFar = -4,    ///< ended since set-points were too far from where it stood
  kMoved = -5,     ///< ended since the arm had stopped or moved without it: the program was paused, and resumed
};

struct UrProgramSettings {
  int session = 1;                ///< of set-points it obeys; others are not for it
  double step = 0.002;            ///< s, of the controller's cycle
  int bridged = 2;                ///< lost cycles over which set-points are extrapolated
  double timeout = 0.05;          ///< s without a new set-point after which it brakes to rest and ends
  double first_wait = 2.0;        ///< s that it waits for the first set-point
  double start_tolerance = 0.05;  ///< rad, of the first set-point to where the arm stands, all joints together
  double return_tolerance = 0.1;  ///< rad, of a set-point to where the arm is after a gap, any joint
  double braking = 10.0;          ///< rad/s^2, when set-points are missing
  double rejoin = 1.3;           ///< times acceleration_max: the most on the way back, so that plans are caught up with
  double state_period = 0.0;     ///< s between states over RTDE, if that is not each cycle; 0: it is
  double lookahead = 0.03;       ///< s, of servoj, 0.03 to 0.2
  double gain = 1000.0;          ///< of servoj, 100 to 2000
  JointVector velocity_max;      ///< rad/s; a set-point that asks for a tenth more is refused. Six.
  JointVector acceleration_max;  ///< rad/s^2, of the plans. Six.
};

/// The URScript program that follows set-points in the registers with servoj, one a control cycle, and ends by itself.
/// It knows how old a set-point is from its own cycle's number, which comes back with it: beyond the smallest age seen
/// so far, it carries the set-point's motion on (q + dq t + ddq t^2 / 2). A program that was paused goes on, when it is
/// resumed, where it was, with whatever it held then: it looks at the controller's own target and ends if that did not
/// follow it. Sums of lists ask for software 3.14.3 or 5.9.4. @pre velocity_max and acceleration_max have six entries
std::string make_ur_program(const UrProgramSettings& settings);

}  // namespace steadyhand
