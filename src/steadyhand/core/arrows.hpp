#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/names.hpp"
#include "steadyhand/core/time.hpp"

/// One plain struct per arrow of the data flow:
/// OperatorSample -> Target -> Reference -> Plan -> JointCommand -> (arm) -> JointState.
namespace steadyhand {

/// A value for each tool of the robot, by its index.
template <typename T>
using PerTool = std::array<T, kMaxTools>;

/// Source of the hand that controls the arm.
enum class Leader : std::uint8_t {
  kPerson,
  kRecording,  ///< playback of a recorded hand
  kPolicy,     ///< a program that sends poses of the tool
};
/// Their names in recordings and the protocol.
constexpr auto names_of(Leader) {
  return named("Leader", {Name{Leader::kPerson, "person"}, Name{Leader::kRecording, "recording", "that plays"},
                          Name{Leader::kPolicy, "policy"}});
}

/// The operator's hand as the headset or recording reports it.
struct OperatorSample {
  Stamp stamp;  ///< `hand`: when the device saw it
  /// Robot axes: z up; the operator's room frame. From a policy: the requested tool pose in the base.
  Pose X_operator_hand;
  bool clutch = false;    ///< true while the clutch is closed
  bool tracked = true;    ///< false: the device has no valid pose now
  bool emulated = false;  ///< WebXR emulatedPosition: position is a guess of the device
  Time look_ahead{0};     ///< the device predicted the pose: it is where the hand will be at stamp.hand + look_ahead
  std::optional<double> gripper{};  ///< requested, 0 open to 1 closed; absent: unchanged
  Leader leader = Leader::kPerson;  ///< its source
  bool intervention = false;        ///< a person controls the arm while the policy waits
  int tool = 0;                     ///< index of the tool that this hand moves
};

/// Where the operator wants the controlled frame (the glass) to be.
struct Target {
  Stamp stamp;                      ///< stamp of the operator sample
  Pose X_base_tool;                 ///< where the controlled frame is to be
  bool engaged = false;             ///< false: pose is where the arm was left; do not follow
  Time look_ahead{0};               ///< as the operator sample's
  Leader leader = Leader::kPerson;  ///< whose hand it comes from
  int tool = 0;                     ///< index of the controlled frame
};

/// Uncertainty of a predicted position. 0: not known.
struct Spread {
  double along = 0.0;   ///< m, standard deviation along the hand's motion
  double across = 0.0;  ///< m, in each direction across it
};

/// One tool's predicted target over the planner's horizon: entry k-1 holds node k = 1..N.
struct ToolReference {
  std::array<Vector3, kMaxHorizon> p;        ///< m, base frame
  std::array<Matrix3, kMaxHorizon> R;        ///< controlled frame to base
  std::array<Spread, kMaxHorizon> spread{};  ///< uncertainty of p
};

/// The predicted targets over the planner's horizon; node k is at time start + k * dt.
struct Reference {
  Stamp stamp;                   ///< stamp of the newest target
  Time start{0};                 ///< time of node 0
  double dt = 0.05;              ///< s
  int nodes = 0;                 ///< N
  PerTool<ToolReference> tools;  ///< of each

  Reference() = default;
  /// @{ Copies the entries in use: most horizons are far shorter than the longest.
  Reference(const Reference& other) { *this = other; }
  Reference& operator=(const Reference& other);
  /// @}
};

/// Origin of a plan.
enum class PlanOrigin {
  kSolved,    ///< converged
  kFeasible,  ///< not converged within its budget, but inside every constraint
  kPrevious,  ///< the new solution failed its check or the solver failed: the rest of the last good plan
};

/// A checked joint trajectory that ends at rest: accelerations constant on intervals of dt (exact double integrator),
/// first the optimal control problem's N intervals, then a stop inside the acceleration limits. After its end the arm
/// is stationary.
struct Plan {
  static constexpr int kMaxIntervals = 2 * kMaxHorizon;  ///< most intervals

  Stamp stamp;                                   ///< stamp of the reference
  Time start{0};                                 ///< time of x_0
  double dt = 0.05;                              ///< s
  int joints = 0;                                ///< n
  int intervals = 0;                             ///< N plus those of the stop
  std::uint64_t world = 0;                       ///< Obstacles::version of those that it was checked against
  PlanOrigin origin = PlanOrigin::kSolved;       ///< its origin
  JointVector velocity_max;                      ///< rad/s (m/s) that its profile allows; empty: what the arm allows
  std::array<StateVector, kMaxIntervals + 1> x;  ///< x_k = [q; dq] at start + k * dt; rad (m), rad/s (m/s)
  std::array<JointVector, kMaxIntervals> u;      ///< ddq on [k, k+1) * dt; rad/s^2 (m/s^2)

  Plan() = default;
  /// @{ Copies the entries in use: a plan goes from thread to thread, and most are far shorter than the longest.
  Plan(const Plan& other) { *this = other; }
  Plan& operator=(const Plan& other);
  /// @}
};

/// Command to the arm for `stamp.made`.
struct JointCommand {
  Stamp stamp;                               ///< `made`: when the arm is to be there
  JointVector q;                             ///< rad (m for prismatic joints)
  JointVector dq;                            ///< rad/s
  JointVector ddq;                           ///< rad/s^2
  PerTool<std::optional<double>> gripper{};  ///< 0 open to 1 closed; absent: the tool is none
};

/// State that the arm reports; measured at `stamp.made`.
struct JointState {
  Stamp stamp;                               ///< `made`: when it was measured
  JointVector q;                             ///< rad
  JointVector dq;                            ///< rad/s
  PerTool<std::optional<double>> gripper{};  ///< measured, 0 open to 1 closed; absent: the tool is none
};

}  // namespace steadyhand
