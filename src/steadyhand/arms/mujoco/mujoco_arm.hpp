#pragma once

#include <cstdint>
#include <memory>

#include "steadyhand/arms/driver/clocked_arm.hpp"
#include "steadyhand/arms/driver/mujoco_settings.hpp"
#include "steadyhand/core/latest_value.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/geometry/robot/urdf_dynamics.hpp"
#include "steadyhand/session/task/scene.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

struct SceneModel;

/// The poses of everything in a simulation, for drawing.
struct SceneView {
  static constexpr int kMaxNumbers = 1024;
  Time at{0};
  std::array<double, kMaxNumbers> numbers{};  ///< MuJoCo's qpos, mocap_pos and mocap_quat, in this order
};

/// An arm in a simulated scene with contact: MuJoCo moves it, its joints have servos of limited torque, and objects
/// that it touches give way or do not. No hardware.
///
/// A servo's torque is the torque for the commanded motion (inverse dynamics of the arm alone) plus stiffness and
/// damping against the error. ContactPolicy limits the latter.
class MujocoArm final : public ClockedArm, public SimulatedScene {
 public:
  /// The arm starts at the model's home, as the scene does. Fails as make_scene_model. Model and clock must outlive it.
  /// @param cell obstacles that do not move
  static Result<std::unique_ptr<MujocoArm>> make(const RobotModel& model, const ChainDynamics& dynamics,
                                                 const Cell& cell, const Task& task, const MujocoSettings& settings,
                                                 Clock& clock);
  ~MujocoArm() override;

  /// Takes effect in one of the next cycles.
  Status set_up(std::uint64_t seed) override;
  bool read_scene(SceneState& state) override { return shown_.read(state); }

  /// Takes SceneView each cycle from now on. Before the first receive(). Fails on scenes with too many numbers for one.
  Status show_views();
  /// The newest view since the last call, if there is one. One thread.
  bool read_view(SceneView& view) { return views_.read(view); }
  /// The simulated scene; constant for the arm's life, except the limits of its actuators.
  const SceneModel& scene_model() const;

  /// N, of all contacts of the arm. Thread of receive().
  double contact_force() const;

 private:
  MujocoArm(const RobotModel& model, std::unique_ptr<SceneModel> scene, const ChainDynamics& dynamics, const Task& task,
            const MujocoSettings& settings, Clock& clock);
  void advance(Time end) override;
  void step(const JointCommand& set_point);
  void place_things();
  bool touches_forbidden() const;
  void show(Time now);
  void show_view(Time now);

  struct Places {
    int count = 0;
    std::array<Pose, kMaxThings> at{};
  };
  struct Simulation;

  Task task_;
  MujocoSettings settings_;
  std::unique_ptr<Simulation> simulation_;
  JointCommand held_;  ///< what the servos hold
  bool led_ = false;   ///< moved by commands in the last cycle
  LatestValue<Places> asked_;
  LatestValue<SceneState> shown_;
  SceneState state_;
  bool shows_views_ = false;
  LatestValue<SceneView> views_;
  SceneView view_;
};

}  // namespace steadyhand
