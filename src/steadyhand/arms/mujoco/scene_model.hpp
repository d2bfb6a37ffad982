#pragma once

#include <mujoco/mujoco.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/geometry/robot/urdf_dynamics.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// A servo answers an error of so much (rad, or m) with all of its torque: its stiffness.
inline constexpr double kErrorAtFullTorque = 0.05;
/// Contact bits of geoms: solids of the arm do not touch each other, which the planner sees to.
inline constexpr int kSceneBit = 1, kArmBit = 2;
/// Of a tool: the actuator that closes it, and the bodies that hold something between them.
inline constexpr const char *kGripper = "gripper", *kFingers[] = {"left_finger", "right_finger"};

/// An arm among its cell's objects and a task's scene, as MuJoCo simulates them. Never changes after it was made, but
/// for the limits of its actuators.
struct SceneModel {
  struct FreeModel {
    void operator()(mjModel* unused) const { mj_deleteModel(unused); }
  };
  std::unique_ptr<mjModel, FreeModel> model;
  std::vector<int> position, velocity;  ///< n: where joint k is in qpos and qvel
  std::vector<int> actuator;            ///< n: where it is in ctrl
  int tool = 0;                         ///< MuJoCo's body whose frame is the controlled one

  /// What MuJoCo calls a thing of the task.
  struct Thing {
    int body = 0;   ///< that it is, or stands on
    int site = -1;  ///< -1: it is the body
  };
  std::vector<Thing> things;  ///< of Task::things

  int gripper = -1;             ///< the actuator that closes it; -1: the tool is none
  double gripper_closed = 1.0;  ///< what that is told for it to be closed
  /// Of a geom, what counts in its contacts.
  struct GeomRole {
    std::uint32_t things = 0;     ///< a bit for each thing that it belongs to
    int finger = -1;              ///< of the gripper: 0 or 1
    int kept_off = -1;            ///< index into Task::keeps_off
    std::uint64_t not_touch = 0;  ///< a bit for each of these that it, of the arm, must not touch
  };
  std::vector<GeomRole> roles;  ///< of all geoms
};

/// The arm: its chain with the masses of its URDF, its bodies as solids that touch whatever is not the arm. Around it
/// the cell's objects as solids that do not move, but for those that are of the task's scene, and that scene. Each
/// joint has a servo with the torque that the URDF allows. Steps are of `step` s. Fails on files that are no MJCF, and
/// where a task names what its files lack, with the reason.
Result<SceneModel> make_scene_model(const RobotModel& arm, const ChainDynamics& dynamics, const Cell& cell,
                                    const Task& task, double step);

/// Objects of the cell for the geoms that the task has the planner keep off. Fails on geoms that are no plane, sphere,
/// capsule, cylinder or box, or move.
Result<std::vector<CellObject>> kept_off(const Task& task);

/// What there is to draw of the things that the task places: the index of a thing, and its solids in its frame, which
/// the arm and the other things may touch. Fails as kept_off.
Result<std::vector<std::pair<int, CellObject>>> placed_solids(const Task& task, const RobotModel& arm);

/// What the task has the planner keep off joins the cell, and the solids of the things that it places, where this seed
/// puts them. Fails as kept_off and draw_places.
Status furnish(const Task& task, const std::vector<std::pair<int, CellObject>>& solids, std::uint64_t seed, Cell& cell);

}  // namespace steadyhand
