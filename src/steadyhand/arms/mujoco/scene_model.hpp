#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "steadyhand/arms/mujoco/mujoco_library.hpp"
#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/geometry/robot/urdf_dynamics.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// Error (rad, or m) at which a servo uses all of its torque: its stiffness.
inline constexpr double kErrorAtFullTorque = 0.05;
/// Contact bits of geoms: solids of the arm do not touch each other; the planner prevents that.
inline constexpr int kSceneBit = 1, kArmBit = 2;
/// Names in a tool's file: the actuator that closes it, and the bodies that hold an object between them.
inline constexpr const char *kGripper = "gripper", *kFingers[] = {"left_finger", "right_finger"};

/// An arm among its cell's objects and a task's scene, as MuJoCo simulates them. Once it is made, only its actuators'
/// limits change.
struct SceneModel {
  struct FreeModel {
    void operator()(mjModel* unused) const { mujoco().mj_deleteModel(unused); }
  };
  std::unique_ptr<mjModel, FreeModel> model;
  std::vector<int> position, velocity;  ///< n: where joint k is in qpos and qvel
  std::vector<int> actuator;            ///< n: where it is in ctrl
  PerTool<int> tool{};                  ///< MuJoCo's body whose frame is the controlled one

  /// MuJoCo's ids for a thing of the task.
  struct Thing {
    int body = 0;   ///< the thing itself, or the body that carries its site
    int site = -1;  ///< -1: it is the body
  };
  std::vector<Thing> things;  ///< of Task::things

  struct Gripper {
    int actuator = -1;    ///< that closes it; -1: the tool is none
    double closed = 1.0;  ///< value of that actuator for a closed gripper
  };
  PerTool<Gripper> gripper{};
  /// Properties of a geom that matter in its contacts.
  struct GeomRole {
    std::uint32_t things = 0;     ///< a bit for each thing that it belongs to
    int finger = -1;              ///< of the gripper, 0 or 1, of the second tool's 2 or 3; -1: none
    int kept_off = -1;            ///< index into Task::keeps_off
    std::uint64_t not_touch = 0;  ///< bits by index into Task::keeps_off: this geom of the arm must not touch those
  };
  std::vector<GeomRole> roles;  ///< one for each geom
};

/// The arm, the cell and the task's scene in one model. The arm is its tree of joints with the masses of its URDF; its
/// bodies are solids that touch everything except the arm. Each tool has the geometry of the task's tool; if there are
/// two, its names there begin with that of the tool and '/'. The cell's objects are solids that do not move; those that
/// belong to the task's scene come from that scene only. Each joint has a servo with the torque that the URDF allows.
/// Steps are of `step` s. Fails, with the reason, on files that are no MJCF, and if a task names what its files lack.
Result<SceneModel> make_scene_model(const RobotModel& arm, const ChainDynamics& dynamics, const Cell& cell,
                                    const Task& task, double step);

/// Objects of the cell for the geoms that the task has the planner keep off. Fails on geoms that are no plane, sphere,
/// capsule, cylinder or box, or move.
Result<std::vector<CellObject>> kept_off(const Task& task);

/// Solids to draw for the things that the task places: the index of a thing, and a solid in its frame, which the arm
/// and the other things may touch. Fails as kept_off.
Result<std::vector<std::pair<int, CellObject>>> placed_solids(const Task& task, const RobotModel& arm);

/// Adds to the cell the task's objects that the planner must avoid, and the solids of the things that it places, at the
/// poses of this seed. Fails as kept_off and draw_places.
Status furnish(const Task& task, const std::vector<std::pair<int, CellObject>>& solids, std::uint64_t seed, Cell& cell);

}  // namespace steadyhand
