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

/// Where everything of a simulation is, for whoever draws it.
struct SceneView {
  static constexpr int kMaxNumbers = 1024;
  Time at{0};
  std::array<double, kMaxNumbers> numbers{};  ///< MuJoCo's qpos, mocap_pos and mocap_quat, in this order
};

/// An arm in a simulated scene with contact: MuJoCo moves it, its joints have servos of limited torque, and what it
/// touches gives way or does not. No hardware.
///
/// A servo's torque is what the motion of the command takes (inverse dynamics of the arm alone), and stiffness and
/// damping against the error; by how much the latter counts at most, ContactPolicy says.
class MujocoArm final : public ClockedArm, public SimulatedScene {
 public:
  /// Stands at the model's home, as the scene does at first. Fails as make_scene_model. Model and clock must outlive
  /// it.
  /// @param cell what stands around it and does not move
  static Result<std::unique_ptr<MujocoArm>> make(const RobotModel& model, const ChainDynamics& dynamics,
                                                 const Cell& cell, const Task& task, const MujocoSettings& settings,
                                                 Clock& clock);
  ~MujocoArm() override;

  /// In one of the next cycles.
  Status set_up(std::uint64_t seed) override;
  bool read_scene(SceneState& state) override { return shown_.read(state); }

  /// Takes SceneView each cycle from now on. Before the first receive(). Fails on scenes with too many numbers for one.
  Status show_views();
  /// The newest view since the last call, if there is one. One thread.
  bool read_view(SceneView& view) { return views_.read(view); }
  /// What is simulated, for the arm's life; but for the limits of its actuators, which change.
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
  bool led_ = false;   ///< by commands, in the last cycle
  LatestValue<Places> asked_;
  LatestValue<SceneState> shown_;
  SceneState state_;
  bool shows_views_ = false;
  LatestValue<SceneView> views_;
  SceneView view_;
};

}  // namespace steadyhand
