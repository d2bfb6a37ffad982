#include "steadyhand/session/task/scripted_operator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace steadyhand {

namespace {

constexpr double kBeforeGrip = 0.2;    // s
constexpr double kAtGrip = 0.7;        // s that the hand waits after the grip: the arm engages, RetargetSettings::ramp
constexpr double kTurnRate = 1.0;      // rad/s, at most on average
constexpr double kPeakToMean = 1.875;  // peak to mean speed of a minimum-jerk motion
constexpr double kShortest = 0.2;      // s
constexpr double kThere = 0.002;       // m, largest distance of the tool from its goal
constexpr double kStands = 0.0005;     // m and rad within kRest
constexpr double kStandsGripper = 0.0005;  // within kRest
constexpr Time kRest = std::chrono::milliseconds(60);
constexpr double kPatience = 3.0;     // s after a move's end, for a tool that does not arrive
constexpr double kFingersNeed = 0.3;  // s until the fingers have started to move

/// Share of the way at share `s` of the time.
double minimum_jerk(double s) { return s * s * s * (10.0 + s * (6.0 * s - 15.0)); }

Quaternion about_z(double angle) { return Quaternion(Eigen::AngleAxisd(angle, Vector3::UnitZ())); }

}  // namespace

ScriptedOperator::ScriptedOperator(const Task& task) : task_(&task) {
  for (const Move& move : task.moves) hands_ = std::max(hands_, static_cast<std::size_t>(move.tool) + 1);
  for (int t = 0; t < kMaxTools; ++t) samples_[t].tool = t;
}

ScriptedOperator ScriptedOperator::taking_over(const Task& task, const SceneState& scene) {
  ScriptedOperator hand(task);
  const auto closes = [](const Move& move) { return move.gripper.value_or(0.0) > 0.5; };
  const auto closing = std::find_if(task.moves.begin(), task.moves.end(), closes);
  if (closing == task.moves.end()) return hand;
  bool grasped = false;
  for (int i = 0; i < scene.things; ++i) grasped |= scene.thing[static_cast<std::size_t>(i)].grasped;
  hand.samples_[closing->tool].gripper = grasped ? 1.0 : 0.0;
  if (grasped) hand.first_ = closing - task.moves.begin() + 1;
  return hand;
}

std::span<const OperatorSample> ScriptedOperator::update(Time now, const SceneState& scene,
                                                         const PerTool<SeenTool>& tools) {
  if (!std::exchange(begun_, true)) start_ = now;
  for (std::size_t t = 0; t < hands_; ++t) {
    samples_[t].stamp = {now, now};
    const bool moves = std::ranges::any_of(
        task_->moves, [&](const Move& move) { return move.tool == static_cast<int>(t) && !move.gripper; });
    samples_[t].clutch = moves && to_seconds(now - start_) >= kBeforeGrip;
    if (!samples_[t].clutch) samples_[t].X_operator_hand = tools[t].X_base_tool;
  }
  if (to_seconds(now - start_) < kBeforeGrip + kAtGrip) {
    begin_move(now, scene, tools);
  } else if (!is_done()) {
    const int tool = task_->moves[static_cast<std::size_t>(move_)].tool;
    const double share = std::clamp(to_seconds(now - move_start_) / duration_, 0.0, 1.0);
    const double part = minimum_jerk(share);
    samples_[tool].X_operator_hand = {from_.p + part * (to_.p - from_.p), from_.q.slerp(part, to_.q)};
    if (share >= 1.0 && is_over(now, tools[tool])) {
      ++move_;
      begin_move(now, scene, tools);
    }
  }
  return std::span(samples_).first(hands_);
}

void ScriptedOperator::begin_move(Time now, const SceneState& scene, const PerTool<SeenTool>& tools) {
  move_ = std::max(move_, first_);
  move_start_ = rest_since_ = now;
  duration_ = kShortest;
  if (is_done()) return;
  const Move& move = task_->moves[static_cast<std::size_t>(move_)];
  last_tool_ = tools[move.tool];
  from_ = to_ = samples_[move.tool].X_operator_hand;
  if (move.gripper) {
    samples_[move.tool].gripper = move.gripper;
    duration_ = kFingersNeed;
    return;
  }
  to_ = goal(move, scene, last_tool_.X_base_tool);
  const double way = (to_.p - from_.p).norm(), turn = from_.q.angularDistance(to_.q);
  duration_ = std::max({kShortest, kPeakToMean * way / move.speed, kPeakToMean * turn / kTurnRate});
}

/// Goal of the tool in this move.
Pose ScriptedOperator::goal(const Move& move, const SceneState& scene, const Pose& X_base_tool) const {
  const Pose& to = scene.thing[move.to].X_base_thing;
  const Pose& led = move.lead ? scene.thing[*move.lead].X_base_thing : X_base_tool;
  double axes = 0.0, spin = 0.0;  // rad, rotation of the offset's axes, and of the tool
  if (move.turn) {
    axes = heading(scene.thing[*move.turn].X_base_thing);
    spin = std::remainder(axes + move.by - heading(led), move.symmetry);
  }
  const Vector3 now_at = about_z(-axes) * (led.p - to.p);
  Vector3 at = move.offset;
  for (int i = 0; i < 2; ++i) at[i] = move.keep[i] ? now_at[i] : at[i];
  // An object that the tool holds keeps its place in the tool.
  Pose tool;
  tool.q = about_z(spin) * from_.q;
  tool.p = to.p + about_z(axes) * at + about_z(spin) * (X_base_tool.p - led.p);
  return tool;
}

/// True once the tool is stationary at its goal, or the fingers are stationary, or after kPatience.
bool ScriptedOperator::is_over(Time now, const SeenTool& tool) {
  const Move& move = task_->moves[static_cast<std::size_t>(move_)];
  const Pose &at = tool.X_base_tool, &last = last_tool_.X_base_tool;
  const bool moves = move.gripper ? std::abs(tool.gripper - last_tool_.gripper) > kStandsGripper
                                  : (at.p - last.p).norm() > kStands || at.q.angularDistance(last.q) > kStands;
  const bool is_there = move.gripper || (at.p - to_.p).norm() < kThere;
  if (moves) {
    rest_since_ = now;
    last_tool_ = tool;
  }
  const double over = to_seconds(now - move_start_) - duration_;
  return (is_there && now - rest_since_ >= kRest) || over > kPatience;
}

}  // namespace steadyhand
