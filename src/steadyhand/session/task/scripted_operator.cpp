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

ScriptedOperator ScriptedOperator::taking_over(const Task& task, const SceneState& scene) {
  ScriptedOperator hand(task);
  const auto closes = [](const Move& move) { return move.gripper.value_or(0.0) > 0.5; };
  const auto closing = std::find_if(task.moves.begin(), task.moves.end(), closes);
  if (closing == task.moves.end()) return hand;
  bool grasped = false;
  for (int i = 0; i < scene.things; ++i) grasped |= scene.thing[static_cast<std::size_t>(i)].grasped;
  hand.gripper_ = grasped ? 1.0 : 0.0;
  if (grasped) hand.first_ = closing - task.moves.begin() + 1;
  return hand;
}

OperatorSample ScriptedOperator::update(Time now, const SceneState& scene, const Pose& X_base_tool, double gripper) {
  if (!std::exchange(begun_, true)) start_ = now;
  gripped_ = to_seconds(now - start_) >= kBeforeGrip;
  if (!gripped_) hand_ = X_base_tool;
  if (to_seconds(now - start_) < kBeforeGrip + kAtGrip) {
    begin_move(now, scene, X_base_tool);
  } else if (!is_done()) {
    const double share = std::clamp(to_seconds(now - move_start_) / duration_, 0.0, 1.0);
    const double part = minimum_jerk(share);
    hand_.p = from_.p + part * (to_.p - from_.p);
    hand_.q = from_.q.slerp(part, to_.q);
    if (share >= 1.0 && is_over(now, X_base_tool, gripper)) {
      ++move_;
      begin_move(now, scene, X_base_tool);
    }
  }
  OperatorSample sample;
  sample.stamp = {now, now};
  sample.X_operator_hand = hand_;
  sample.clutch = gripped_;
  sample.gripper = gripper_;
  return sample;
}

void ScriptedOperator::begin_move(Time now, const SceneState& scene, const Pose& X_base_tool) {
  move_ = std::max(move_, first_);
  move_start_ = rest_since_ = now;
  last_tool_ = X_base_tool;
  from_ = to_ = hand_;
  duration_ = kShortest;
  if (is_done()) return;
  const Move& move = task_->moves[static_cast<std::size_t>(move_)];
  if (move.gripper) {
    gripper_ = move.gripper;
    duration_ = kFingersNeed;
    return;
  }
  to_ = goal(move, scene, X_base_tool);
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
bool ScriptedOperator::is_over(Time now, const Pose& X_base_tool, double gripper) {
  const Move& move = task_->moves[static_cast<std::size_t>(move_)];
  const bool moves = move.gripper ? std::abs(gripper - last_gripper_) > kStandsGripper
                                  : (X_base_tool.p - last_tool_.p).norm() > kStands ||
                                        X_base_tool.q.angularDistance(last_tool_.q) > kStands;
  const bool is_there = move.gripper || (X_base_tool.p - to_.p).norm() < kThere;
  if (moves) {
    rest_since_ = now;
    last_tool_ = X_base_tool;
    last_gripper_ = gripper;
  }
  const double over = to_seconds(now - move_start_) - duration_;
  return (is_there && now - rest_since_ >= kRest) || over > kPatience;
}

}  // namespace steadyhand
