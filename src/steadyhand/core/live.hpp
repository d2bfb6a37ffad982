#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/arrows.hpp"

/// What the threads of a live session tell each other and the operator's page beside the arrows.
namespace steadyhand {

/// What the arm is allowed to do now.
enum class SupervisionState : std::uint8_t {
  kIdle,      ///< the arm does not follow set-points yet
  kReady,     ///< the arm stands; an engagement would move it
  kEngaged,   ///< the arm follows the hand
  kHolding,   ///< engaged, but the hand cannot be trusted now: the arm rests where it was led
  kStopping,  ///< a stop was asked for: the arm comes to rest and then waits for a reset
  kFault,     ///< the arm or a part of the program failed: nothing moves until a reset
};

/// As recordings and the protocol call it, e.g. "engaged".
std::string_view to_string(SupervisionState state);

/// The state of supervision changed.
struct SupervisionChange {
  Time at{0};
  SupervisionState from = SupervisionState::kIdle, to = SupervisionState::kIdle;
  std::string_view reason;  ///< static text
  bool is_failure = false;  ///< the arm stops, and nobody asked for it
};

/// Which limit of the optimal control problem holds the arm back.
enum class ConstraintKind : std::uint8_t { kNone, kPosition, kVelocity, kAcceleration, kSelfCollision, kReach };
/// As recordings and the protocol call it, e.g. "self_collision".
std::string_view to_string(ConstraintKind kind);

struct ActiveConstraint {
  ConstraintKind kind = ConstraintKind::kNone;
  int first = -1;   ///< joint, or first sphere of the pair
  int second = -1;  ///< second sphere of the pair
};

/// The liquid in the glass: its surface as a plane that swings.
struct LiquidState {
  double tilt_x = 0.0, tilt_y = 0.0;  ///< rad, of the surface's normal about the glass's x and y axes
  double freeboard = 0.0;             ///< m, from the surface's highest point to the rim; negative: over the rim
  bool spilled = false;               ///< has gone over the rim since the last reset
};

/// Percentiles of what was counted in the last few seconds.
struct TimingSummary {
  double p50 = 0.0, p99 = 0.0, p999 = 0.0, max = 0.0;  ///< us
};

/// What an operator asks for beside moving the hand. Any client may stop; the rest needs the lease.
struct OperatorRequest {
  enum class Kind : std::uint8_t {
    kStop,      ///< bring the arm to rest now
    kReset,     ///< after a stop or a fault: ready again, where the arm stands
    kProfile,   ///< `text`: its name
    kWeight,    ///< `text`: name of an objective, `value`: its weight, >= 0
    kScale,     ///< `value`: metres of the tool for each metre of the hand, > 0
    kYaw,       ///< `value`: turn of the operator's frame, rad
    kRate,      ///< `value`: planning steps a second, Hz
    kPlayback,  ///< `text`: name of a built-in recording to take as the hand; empty: end it
    kRecord,    ///< `value` 0 or 1: whether the session is recorded
  };
  Kind kind = Kind::kStop;
  std::string text;
  double value = 0.0;
};

/// What the operator has chosen.
struct SessionControls {
  int profile = 0;                               ///< index into the profiles that the server was started with
  std::array<double, kMaxObjectives> weights{};  ///< of each objective the first
  int objectives = 0;                            ///< entries of weights in use
  double scale = 0.5;                            ///< metres of the tool for each metre of the hand
  double yaw = 0.0;                              ///< turn of the operator's axes about base z, rad
  int playback = -1;                             ///< index of the built-in recording that plays the hand; -1: none
};

/// One look at a live session; the web thread sends it to every client.
struct SessionSnapshot {
  Time now{0};  ///< of the session's clock
  SupervisionState state = SupervisionState::kIdle;
  std::string_view reason;  ///< why it is in this state; static text
  ActiveConstraint constraint;
  Target target;  ///< without a grip, where the controlled frame is: the next grip begins there
  JointState measured;
  JointCommand command;
  Pose X_base_tool;              ///< where the controlled frame is, from `measured`
  Vector3 local_acceleration;    ///< m/s^2, glass frame, a liquid at rest feels [0, 0, 9.81]
  double tracking_error = 0.0;   ///< m, target to controlled frame; NaN without a grip
  double clearance = 0.0;        ///< m, of the nearest pair of spheres
  std::array<int, 2> nearest{};  ///< that pair
  int path_nodes = 0;
  std::array<Pose, kMaxHorizon + 1> path;  ///< of the controlled frame at the plan's nodes; path_nodes of them
  LiquidState liquid;
  TimingSummary solve_us, latency_us;  ///< planner's solve; hand to command
  TimingSummary wake_us;               ///< how late control cycles began
  std::uint64_t plans = 0, cycles = 0, missed_deadlines = 0, rejected_plans = 0, samples = 0;
  double planner_rate_hz = 0.0;
  bool recording = false;
  SessionControls controls;
};

}  // namespace steadyhand
