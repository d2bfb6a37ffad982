#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <utility>

#include "steadyhand/arms/driver/simulated_arm.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/session/live/control_stage.hpp"
#include "steadyhand/session/live/monitor.hpp"
#include "steadyhand/session/live/planning_stage.hpp"
#include "support/manual_clock.hpp"

namespace steadyhand {

inline const RobotModel& ur5e() {
  static const Result<RobotModel> model = open_robot("ur5e");
  EXPECT_TRUE(model) << model.error().message;
  return *model;
}

/// A live session on one thread and a clock that only it moves: the stages of the real one, called in the order of
/// their time. Faults go in between.
class VirtualSession {
 public:
  struct Options {
    const RobotModel* model = &ur5e();
    std::string profile = "waiter";
    double planner_rate_hz = 50.0;
    double solve_time = 0.003;  ///< s that a plan takes to reach control
    double scale = 1.0;
    double first_moves = 0.0, first_speed_scaling = 1.0;
    std::vector<PlanningSettings::Choice> more;
    SolveBudget budget;
    bool together = true;  ///< see SupervisorSettings
    SimulatedArmSettings arm;
    Obstacles obstacles;  ///< at first
    /// Makes another arm than that.
    std::function<std::unique_ptr<Arm>(Clock&)> make_arm;

    static Options at_rate(double hz) {
      Options options;
      options.planner_rate_hz = hz;
      options.solve_time = std::min(options.solve_time, 0.4 / hz);
      return options;
    }
  };

  explicit VirtualSession(const Options& options) : options_(options), model_(*options.model) {
    arm_ = options.make_arm ? options.make_arm(clock_)
                            : std::make_unique<SimulatedArm>(model_, model_.home, options.arm, clock_);
    const auto profile = load_profile(options.profile);
    EXPECT_TRUE(profile) << profile.error().message;
    PlanningSettings planning(*profile);
    planning.retarget.scale = options.scale;
    planning.retarget.yaw = 0.0;
    planning.more = options.more;
    planning.first_moves = options.first_moves;
    planning.first_speed_scaling = options.first_speed_scaling;
    planning.retarget.ramp = 0.5;
    planning.cycle = 1.0 / arm_->info().rate_hz;
    planning.planner.budget = options.budget;
    planning.planner.obstacles = options.obstacles;
    planning.look_ahead = PlanningSettings::default_look_ahead(1.0 / options.planner_rate_hz);
    auto stage = PlanningStage::make(model_, planning, planner_side_, clock_);
    EXPECT_TRUE(stage) << stage.error().message;
    planning_ = std::move(*stage);
    ControlSettings control;
    control.arm_delay = arm_->info().delay;
    control.obstacles = options.obstacles;
    control.supervisor.together = options.together;
    control_ = std::make_unique<ControlStage>(model_, control, control_side_);
    monitor_ = std::make_unique<Monitor>(model_, GlassSettings{});
    watch(options.obstacles);
    next_step_ = next_sample_ = clock_.now();
  }
  /// At 50 Hz, where a test takes a moment; STEADYHAND_TEST_RATE runs all of them at another rate.
  VirtualSession() : VirtualSession(Options::at_rate(usual_rate())) {}
  static double usual_rate() {
    const char* rate = std::getenv("STEADYHAND_TEST_RATE");
    return rate == nullptr ? 50.0 : std::atof(rate);
  }

  /// The hand's pose at a time: each 11 ms its sample goes through `channel`, which calls `deliver` for what arrives.
  std::function<Pose(double t)> hand = [](double) { return Pose{}; };
  bool clutch = false;
  /// The same of a second tool, if the robot has one.
  std::function<Pose(double t)> second_hand = [](double) { return Pose{}; };
  bool second_clutch = false;
  std::function<void(OperatorSample)> channel = [this](const OperatorSample& sample) { deliver(sample); };
  bool planner_runs = true;
  /// Called before (true) and after (false) each step of a stage.
  std::function<void(bool begins)> around_control = [](bool) {}, around_planner = [](bool) {};
  /// Called for what the arm reports in each cycle.
  std::function<void(const ArmState&)> on_state = [](const ArmState&) {};
  /// Called for every command before the arm gets it.
  std::function<void(const JointCommand&)> on_command = [](const JointCommand&) {};

  void deliver(OperatorSample sample) {
    sample.stamp.made = clock_.now();
    planner_side_.samples.push({sample, planner_side_.holder});
  }

  void run(double seconds) {
    const Time end = clock_.now() + from_seconds(seconds);
    while (clock_.now() < end) cycle();
  }
  /// Runs until the condition holds; false if it does not within `seconds`.
  bool run_until(const std::function<bool()>& condition, double seconds) {
    const Time end = clock_.now() + from_seconds(seconds);
    while (clock_.now() < end && !condition()) cycle();
    return condition();
  }
  /// Opens and closes the clutch and waits until the arm follows.
  bool grip() { return grip(0); }
  /// The same of the hand of a tool.
  bool grip(int tool) {
    bool& closed = tool == 0 ? clutch : second_clutch;
    closed = false;
    run(0.05);
    closed = true;
    return run_until([&] { return view.hands[tool].state == SupervisionState::kEngaged; }, 0.5);
  }
  /// Grips with this hand, which moves already, and has the arm follow it for so long.
  void lead(std::function<Pose(double t)> with, double seconds = 0.0) {
    hand = std::move(with);
    run(0.2);
    ASSERT_TRUE(grip()) << view.reason;
    run(seconds);
  }

  void cycle() {
    const ArmState measured = arm_->receive();
    on_state(measured);
    const Time now = measured.joints.stamp.made;
    for (; next_sample_ <= clock_.now(); next_sample_ += std::chrono::milliseconds(11)) {
      OperatorSample sample;
      sample.stamp = {next_sample_, next_sample_};
      sample.X_operator_hand = hand(to_seconds(next_sample_));
      sample.clutch = clutch;
      channel(sample);
      if (model_.tool_count() == 1) continue;
      sample.tool = 1;
      sample.X_operator_hand = second_hand(to_seconds(next_sample_));
      sample.clutch = second_clutch;
      channel(sample);
    }
    PerTool<HandReport> reports;
    if (planner_side_.hands.read(reports)) control_side_.hands.write(reports);
    if (plan_due_ <= clock_.now() && planner_side_.plan.read(plan_)) control_side_.plan.write(plan_);
    around_control(true);
    const ControlStage::Output& output = control_->step(measured);
    around_control(false);
    if (output.restart_arm) arm_->restart();
    on_command(output.command);
    if (output.follows != nullptr) arm_->follow(*output.follows);
    arm_->send(output.command);
    // The plan that the arm is set to follow is the one that its commands are samples of, whichever fault occurs.
    if (output.follows != nullptr) followed_ = *output.follows;
    const JointCommand planned = sample(followed_, output.command.stamp.made);
    EXPECT_TRUE(planned.q == output.command.q && planned.dq == output.command.dq) << to_seconds(now);
    last_command = output.command;
    for (int t = 0; t < model_.tool_count(); ++t) {
      const std::uint64_t refills = control_side_.refills[t];
      if (std::exchange(refills_[t], refills) != refills) refill(t);
    }
    JointCommand moved;
    while (control_side_.moved.pop(moved)) planner_side_.moved.push(moved);
    TappedCommand tapped;
    while (control_side_.taps.commands.pop(tapped)) monitor_->update(tapped.command, tapped.anew);
    JointState joints;
    while (control_side_.taps.states.pop(joints)) monitor_->update(joints);
    (void)control_side_.control_view.read(view);

    if (now < next_step_) return;
    if (planner_runs) {
      ControlReport told;
      if (control_side_.report.read(told)) planner_side_.report.write(told);
      if (control_side_.followed.read(followed_)) planner_side_.followed.write(followed_);
      around_planner(true);
      planning_->step(clock_.now());
      around_planner(false);
      plan_due_ = clock_.now() + from_seconds(options_.solve_time);
      (void)planner_side_.planner_view.read(planner_view);
    }
    while (next_step_ <= clock_.now()) next_step_ += from_seconds(1.0 / options_.planner_rate_hz);
  }

  SupervisionState state() const { return control_->state(); }
  bool at_rest() const { return view.at_rest; }
  void ask_stop() { control_side_.asked.stop(); }
  /// A full glass, for the planner and the monitor.
  void refill(int tool = 0) {
    ++planner_side_.refills[tool];
    spilled_ = spilled();
    monitor_->reset_liquid(tool);
  }
  /// From any glass so far.
  bool spilled() const { return spilled_ || monitor_->spilled(); }
  void set_obstacles(Obstacles obstacles) {
    obstacles.version = ++world_;
    control_side_.obstacles_to_control.write(obstacles);
    planner_side_.obstacles_to_plan.write(obstacles);
    watch(obstacles);
  }
  /// Only the monitor knows of these.
  void watch(const Obstacles& obstacles) {
    std::vector<std::string> names;
    for (int i = 0; i < obstacles.count; ++i) names.push_back("object " + std::to_string(i));
    monitor_->set_obstacles(obstacles, std::move(names));
  }
  void fail(const char* why) { control_side_.failure = why; }
  void ask_reset() { control_side_.asked.reset(); }
  void set(const OperatorSettings& settings) { planner_side_.settings.write(settings); }
  Pose glass(const JointVector& q, int tool = 0) {
    kinematics_.set_position(q);
    return {kinematics_.p(tool), Quaternion(kinematics_.R(tool))};
  }
  SimulatedArm& arm() { return dynamic_cast<SimulatedArm&>(*arm_); }
  ManualClock& clock() { return clock_; }
  double now() const { return to_seconds(clock_.now()); }
  const Monitor& monitor() const { return *monitor_; }
  Options& options() { return options_; }
  /// Hand to the first command made from it.
  TimingSummary latency_us() const { return control_side_.latency_us.summary(); }
  Links& planner_side() { return planner_side_; }
  PlanningStage& planning() { return *planning_; }

  ControlView view;
  PlannerView planner_view;
  JointCommand last_command;

  /// The invariants after any fault. Call at the end of every test. @param forced the arm was moved by force
  void expect_safe(bool forced = false) const {
    const MonitorResult& seen = monitor_->result();
    EXPECT_TRUE(seen.beyond_limits == 0 && seen.in_contact == 0 && (forced || seen.too_fast == 0)) << to_text(seen);
    EXPECT_GT(seen.commands, 0u);
  }

 private:
  Options options_;
  const RobotModel& model_;
  ManualClock clock_;
  std::unique_ptr<Arm> arm_;
  Links planner_side_, control_side_;  ///< the delay between them is the solve time
  std::unique_ptr<PlanningStage> planning_;
  std::unique_ptr<ControlStage> control_;
  std::unique_ptr<Monitor> monitor_;
  Kinematics kinematics_{model_};
  Plan plan_, followed_;
  Time next_step_, next_sample_, plan_due_{0};
  std::uint64_t world_ = 0;
  PerTool<std::uint64_t> refills_{};
  bool spilled_ = false;
};

/// A hand that sweeps smoothly through `extent` m in x, y and z.
inline std::function<Pose(double)> sweeping(const Vector3& extent, double speed = 2.0) {
  return [=](double t) {
    Pose pose;
    pose.p = Vector3(extent.x() * std::sin(speed * t), extent.y() * std::sin(1.3 * speed * t + 1.0),
                     extent.z() * std::sin(0.7 * speed * t + 2.0));
    pose.q = Eigen::AngleAxisd(0.2 * std::sin(speed * t), Vector3::UnitZ());
    return pose;
  };
}

}  // namespace steadyhand
