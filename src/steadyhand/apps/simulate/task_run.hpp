#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/arms/mujoco/mujoco_arm.hpp"
#include "steadyhand/files/archive/session_recorder.hpp"
#include "steadyhand/files/config/places.hpp"
#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/operator/protocol/scene_things.hpp"
#include "steadyhand/planning/pipeline/profile.hpp"
#include "steadyhand/session/live/one_thread_session.hpp"
#include "steadyhand/session/task/scripted_operator.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// Common parts of all runs of a task.
struct TaskStage {
  RobotModel model;
  ChainDynamics dynamics;
  Task task;
  Profile profile;
  MujocoSettings mujoco;
  LiveSettings live;  ///< except the profile's values; its cell has the obstacles without the task's
  std::vector<std::pair<int, CellObject>> solids;  ///< what the task places

  /// Planning at this rate (Hz), a hand's motion is the tool's. Fails as open_task, open_robot, open_dynamics,
  /// load_profile and open_cell.
  /// @param robot empty: the task's
  static Result<TaskStage> open(const std::string& task, const std::string& robot, const std::string& profile,
                                double rate_hz, const Places& places = Places::standard());
};

/// A task in virtual time, as fast as the machine can: a live session with its operator interface, an arm in a scene,
/// and the judge take turns on one thread. Hands and policies control the arm as in any session.
class TaskRun {
 public:
  /// Stage must outlive it. Fails as MujocoArm::make and OneThreadSession::make.
  static Result<std::unique_ptr<TaskRun>> make(const TaskStage& stage, std::uint64_t seed);
  ~TaskRun();

  /// Records it as a live session: an episode that is kept, with whether it succeeded. Before the first step. Fails,
  /// with the reason, where nothing can be recorded there.
  /// @param metadata in addition to describe_run()
  Status record(std::unique_ptr<RecordingPlace> place, RecordingSettings settings, SessionRecorder::Metadata metadata);
  /// Completes the recording. @return where it is, or what failed, for people
  std::vector<std::string> finish_recording();

  /// Called 100 times a second with the session's state; feeds hands and targets to desk(). Before the first step.
  std::function<void(const SessionSnapshot&)> on_look;
  /// Feeds the hands of a scripted operator who sees this state. Call it in on_look.
  void operate(ScriptedOperator& person, const SessionSnapshot& look);
  /// One cycle of the arm, and what is due by then.
  void step();

  Time now() const { return clock_.now(); }
  OperatorInterface& desk() { return *desk_; }
  OneThreadSession& session() { return *session_; }
  const SceneState& scene() const { return scene_; }
  const TaskProgress& progress() const { return judge_.progress(); }
  const SessionSnapshot& look() const { return look_; }
  bool ready() const { return ready_; }           ///< the arm and the scene have been seen
  const Status& fault() const { return fault_; }  ///< first error of the scene's things in the cell
  /// Done, out of time, halted or at fault.
  bool is_over() const { return judge_.progress().success || session_->is_halted() || !fault_; }

 private:
  explicit TaskRun(const TaskStage& stage);
  void see(const SessionSnapshot& look);
  Status mark(EpisodeMark::Kind kind);

  const TaskStage* stage_;
  SteppedClock clock_{nullptr};
  std::unique_ptr<MujocoArm> arm_;
  std::unique_ptr<OneThreadSession> session_;
  std::unique_ptr<OperatorInterface> desk_;
  std::optional<SessionRecorder> recorder_;
  TaskJudge judge_;
  SceneThings things_;
  SceneState scene_;
  SessionSnapshot look_;
  Status fault_ = Done{};
  bool ready_ = false, started_ = false;
};

}  // namespace steadyhand
