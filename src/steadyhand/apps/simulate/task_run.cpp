#include "steadyhand/apps/simulate/task_run.hpp"

#include <limits>

#include "steadyhand/arms/mujoco/scene_model.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/robot_file.hpp"
#include "steadyhand/files/config/task_file.hpp"
#include "steadyhand/operator/protocol/session_setup.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {

Result<TaskStage> TaskStage::open(const std::string& task, const std::string& robot, const std::string& profile,
                                  double rate_hz, const Places& places) {
  if (Status s = load_mujoco(places.packages); !s) return s.error();
  TaskStage stage;
  Result<Task> opened = open_task(task, places);
  if (!opened) return opened.error();
  stage.task = *std::move(opened);
  const std::string name = !robot.empty() ? robot : stage.task.robot.empty() ? "ur5e" : stage.task.robot;
  Result<RobotModel> model = open_robot(name, places);
  if (!model) return model.error();
  stage.model = *std::move(model);
  std::vector<std::string> tools;
  for (const Tool& tool : stage.model.tools) tools.push_back(tool.name);
  if (Status s = find_tools(stage.task, tools); !s) return s.error();
  Result<ChainDynamics> dynamics = open_dynamics(name, places);
  if (!dynamics) return dynamics.error();
  stage.dynamics = *std::move(dynamics);
  Result<Profile> loaded = load_profile(profile, places);
  if (!loaded) return loaded.error();
  stage.profile = *std::move(loaded);
  add_posture_where_redundant(stage.profile.ocp, stage.model);
  Result<Cell> cell = open_cell("pedestal", places);
  if (!cell) return cell.error();
  stage.live = operator_defaults();
  stage.live.cell = in_base(*std::move(cell), stage.model);
  stage.live.planner_rate_hz = rate_hz;
  stage.live.time_budget = false;
  stage.live.planning.retarget.scale = 1.0;
  stage.live.planning.retarget.yaw = 0.0;
  auto solids = placed_solids(stage.task, stage.model);
  if (!solids) return solids.error();
  stage.solids = *std::move(solids);
  return stage;
}

TaskRun::TaskRun(const TaskStage& stage) : stage_(&stage), judge_(stage.task), things_(stage.solids) {}
TaskRun::~TaskRun() = default;

Result<std::unique_ptr<TaskRun>> TaskRun::make(const TaskStage& stage, std::uint64_t seed) {
  std::unique_ptr<TaskRun> run(new TaskRun(stage));
  LiveSettings live = stage.live;
  if (Status s = furnish(stage.task, stage.solids, seed, live.cell); !s) return s.error();
  take_profiles({stage.profile}, 0, live);
  MujocoSettings mujoco = stage.mujoco;
  mujoco.seed = static_cast<unsigned>(seed);
  auto arm = MujocoArm::make(stage.model, stage.dynamics, live.cell, stage.task, mujoco, run->clock_);
  if (!arm) return arm.error();
  run->arm_ = *std::move(arm);
  auto session = OneThreadSession::make(stage.model, live, *run->arm_, run->clock_);
  if (!session) return session.error();
  run->session_ = *std::move(session);
  run->desk_ = std::make_unique<OperatorInterface>(*run->session_, std::vector<Profile>{stage.profile}, 0,
                                                   live.planning.retarget, live.glass, std::vector<NamedRecording>{});
  return run;
}

Status TaskRun::record(std::unique_ptr<RecordingPlace> place, RecordingSettings settings,
                       SessionRecorder::Metadata metadata) {
  LiveSettings live = stage_->live;
  take_profiles({stage_->profile}, 0, live);
  live.cell = session_->cell_set().cell;
  for (auto& [name, entries] : describe_run(stage_->model, live, {stage_->profile}, 0, session_->planner_rate_hz())) {
    metadata[name].merge(entries);
  }
  settings.flight_seconds = 0.0;  // all of it is recorded
  recorder_.emplace(session_->ocp(), settings, std::move(metadata), clock_.now(), std::move(place));
  if (recorder_->recording()) return Done{};
  const std::vector<std::string> why = recorder_->take_notices();
  return Error{why.empty() ? "not recorded" : why.front()};
}

std::vector<std::string> TaskRun::finish_recording() {
  if (!recorder_) return {};
  const Status kept = ready_ ? mark(EpisodeMark::Kind::kKeep) : Done{};
  recorder_->finish(session_->summary());
  std::vector<std::string> notices = recorder_->take_notices();
  if (!kept) notices.push_back(kept.error().message);
  return notices;
}

Status TaskRun::mark(EpisodeMark::Kind kind) {
  EpisodeMark mark;
  mark.at = clock_.now();
  mark.episode = 1;
  mark.kind = kind;
  mark.task = stage_->task.instruction;
  if (kind == EpisodeMark::Kind::kKeep) mark.success = judge_.progress().success.value_or(false);
  return recorder_->mark(mark);
}

void TaskRun::operate(ScriptedOperator& person, const SessionSnapshot& look) {
  PerTool<SeenTool> seen;
  for (int t = 0; t < look.tool_count; ++t) {
    const ToolSnapshot& tool = look.tools[t];
    seen[t] = {tool.X_base_tool, tool.gripper.value_or(std::numeric_limits<double>::quiet_NaN())};
  }
  for (const OperatorSample& sample : person.update(look.now, scene_, seen)) desk_->hand(sample);
}

void TaskRun::step() {
  if (!started_) {
    started_ = true;
    LiveTaps taps;
    if (recorder_) taps = recorder_->taps();
    taps.look = [this, record = std::move(taps.look)](const SessionSnapshot& look) {
      see(look);
      if (record) record(look);
    };
    session_->start(std::move(taps));
  }
  session_->step();
  (void)desk_->poll(clock_.now());
}

void TaskRun::see(const SessionSnapshot& look) {
  look_ = look;
  if (look.state == SupervisionState::kIdle || (!arm_->read_scene(scene_) && !ready_)) return;
  if (recorder_ && !ready_) (void)mark(EpisodeMark::Kind::kBegin);  // of one that cannot begin, the end reports it
  ready_ = true;
  const TaskProgress& progress = judge_.update(scene_, spilled_share(look));
  if (recorder_) recorder_->see({scene_, progress});
  if (Status s = things_.follow(scene_, *session_); !s && fault_) fault_ = s;
  if (on_look) on_look(look);
}

}  // namespace steadyhand
