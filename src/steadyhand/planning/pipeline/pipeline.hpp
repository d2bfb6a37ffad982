#pragma once

#include <memory>
#include <vector>

#include "steadyhand/planning/pipeline/profile.hpp"
#include "steadyhand/planning/plan/planner.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "steadyhand/planning/predict/predictor.hpp"
#include "steadyhand/planning/retarget/retargeter.hpp"

namespace steadyhand {

/// Settings of each stage; the defaults are the program's.
struct PipelineSettings {
  double rate_hz = 20.0;        ///< plans per second in update(); 0.001 to 1e4
  RetargetSettings retarget;    ///< from the hand to the target
  PredictorSettings predictor;  ///< horizon, dt and reach are set from the problem and the robot
  OcpSettings ocp;              ///< objectives, constraints, horizon
  PlannerSettings planner;      ///< solver and check of plans

  PipelineSettings() = default;
  /// Settings from a profile: its problem, solver and tolerance.
  explicit PipelineSettings(const Profile& profile);
};

/// From the operator's hand to joint commands: retargeting, prediction, planning and tracking, connected as in the
/// program. Assumes that the arm follows its commands. One thread; `make` allocates all memory.
///
///     auto arm = open_pipeline("ur5e", "waiter");  // steadyhand/files.hpp
///     (*arm)->feed({{now, now}, X_operator_hand, clutch});
///     JointCommand command = (*arm)->update(now);
class Pipeline {
 public:
  /// Fails as Planner::make, and on other numbers out of range, with the reason.
  static Result<std::unique_ptr<Pipeline>> make(RobotModel model, const PipelineSettings& settings);

  /// A hand at one time; times count from any epoch, that of update(). Engages and releases with the clutch.
  /// Fails, and changes nothing, on a pose with numbers that are not finite or a quaternion whose length is not 1 to a
  /// thousandth, on times more than 9e9 s from the epoch, on a look-ahead of more than 10 s, and on a tool that the
  /// robot does not have.
  Status feed(const OperatorSample& sample);
  /// The set-point of the arm at `now`. Makes a new plan first if the last is older than a period of the rate. Call it
  /// as often as the arm takes commands; times that go back repeat the last command, those beyond 9e9 s count as 9e9 s.
  JointCommand update(Time now);

  /// The arm is stationary at q from `now` on, and a closed clutch engages there again. q: rad (m), n of them.
  /// Fails, and changes nothing, on another count, numbers that are not finite or beyond the arm's limits, and on a
  /// time more than 9e9 s from the epoch.
  Status reset(const JointVector& q, Time now);

  // ---- The steps of update(), for callers with their own clock.
  /// A plan from `now` on, which is followed from then on.
  const Plan& plan(Time now);
  /// The followed plan at `now`.
  JointCommand command(Time now) const { return tracker_.update(now); }

  const RobotModel& model() const { return *model_; }  ///< the arm; lives as long as this
  // ---- of the hand that moves this tool
  const Target& target(int tool = 0) const { return hands_[tool].target; }  ///< where the newest sample wants the tool
  Retargeter& retargeter(int tool = 0) { return hands_[tool].retargeter; }  ///< to change scale and axes
  Predictor& predictor(int tool = 0) { return hands_[tool].predictor; }     ///< prediction of the target
  const Predictor& predictor(int tool = 0) const { return hands_[tool].predictor; }  ///< prediction of the target
  Planner& planner() { return *planner_; }              ///< to change weights; result of the last solve
  const Planner& planner() const { return *planner_; }  ///< result of the last solve

 private:
  Pipeline(std::unique_ptr<const RobotModel> model, const PipelineSettings& settings, std::unique_ptr<Planner> planner);

  struct Hand {
    Retargeter retargeter;
    Predictor predictor;
    Target target{};
  };
  Reference predict(Time now);
  void hold_others(const JointCommand& at_start);
  bool any_follows() const;
  bool holds_one_thing() const;

  std::unique_ptr<const RobotModel> model_;  ///< must not move in memory: planner and kinematics point to it
  Time period_;
  std::vector<Hand> hands_;  ///< of each tool
  std::unique_ptr<Planner> planner_;
  Tracker tracker_;
  Kinematics arm_;
  Pose X_tool_tool_;  ///< second tool in the first, at the last engagement of any
  bool fed_ = false, planned_ = false;
  Time next_plan_{0}, newest_{Time::min()};
};

}  // namespace steadyhand
