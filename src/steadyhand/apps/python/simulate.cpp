#ifdef STEADYHAND_SIMULATE
#include <fmt/format.h>
#include <nanobind/stl/optional.h>

#include <limits>

#include "steadyhand/apps/python/module.hpp"
#include "steadyhand/apps/simulate/task_run.hpp"
#include "steadyhand/session/task/scripted_operator.hpp"

namespace steadyhand::python {

namespace {

/// A run of a task, and what may control it: hands from Python, the scripted operator, a policy.
struct Simulation {
  TaskStage stage;
  std::unique_ptr<TaskRun> run;
  std::optional<Pose> person;  ///< where Python's hand is closed, in the base
  std::optional<double> person_gripper;
  std::optional<ScriptedOperator> operator_;

  Simulation(const std::string& task, const std::string& robot, const std::string& profile, double rate_hz)
      : stage(value_of(TaskStage::open(task, robot, profile, rate_hz))) {}

  void begin(std::uint64_t seed) {
    const Unlocked unlocked;
    person.reset();
    operator_.reset();
    run = value_of(TaskRun::make(stage, seed));
    run->on_look = [this](const SessionSnapshot& look) { feed(look); };
    while (!run->ready() && !run->is_over()) run->step();
  }

  /// The person's hand, 100 times a second.
  void feed(const SessionSnapshot& look) {
    if (operator_) {
      run->operate(*operator_, look);
      return;
    }
    OperatorSample sample;
    sample.stamp = {look.now, look.now};
    sample.X_operator_hand = person.value_or(look.tools[0].X_base_tool);
    sample.clutch = person.has_value();
    if (person) sample.gripper = person_gripper;
    run->desk().hand(sample);
  }

  void advance(double seconds) {
    const Unlocked unlocked;
    const Time end = run->now() + from_seconds(seconds);
    while (run->now() < end && !run->progress().success && run->fault()) run->step();
  }

  nb::dict observe() const {
    const SessionSnapshot& look = run->look();
    const ToolSnapshot& tool = look.tools[0];  // tasks are of one
    nb::dict o;
    o["t"] = to_seconds(look.now);
    o["state"] = to_text(to_string(look.state));
    o["reason"] = to_text(look.reason);
    const bool led = look.state == SupervisionState::kEngaged || look.state == SupervisionState::kHolding;
    o["leader"] = led ? nb::object(to_text(to_string(tool.target.leader))) : nb::none();
    o["q"] = from_vector(look.measured.q);
    o["dq"] = from_vector(look.measured.dq);
    o["command"] = from_vector(look.command.q);
    o["gripper"] = tool.gripper ? nb::cast(*tool.gripper) : nb::none();
    o["gripper_command"] = tool.gripper_command ? nb::cast(*tool.gripper_command) : nb::none();
    o["T_base_tool"] = from_pose(tool.X_base_tool.p, tool.X_base_tool.q.toRotationMatrix());
    o["T_base_target"] = from_pose(tool.target.X_base_tool.p, tool.target.X_base_tool.q.toRotationMatrix());
    nb::dict things;
    const SceneState& scene = run->scene();
    for (int i = 0; i < scene.things; ++i) {
      const Pose& at = scene.thing[i].X_base_thing;
      things[stage.task.things[i].c_str()] = from_pose(at.p, at.q.toRotationMatrix());
    }
    o["things"] = things;
    return o;
  }

  nb::dict outcome() const {
    const TaskProgress& progress = run->progress();
    const LiveSummary summary = run->session().summary();
    nb::dict o;
    o["success"] = progress.success ? nb::cast(*progress.success) : nb::none();
    o["time"] = progress.time;
    o["spilled"] = progress.spilled;
    o["forbidden"] = run->scene().forbidden;
    o["beyond_limits"] = summary.monitor.beyond_limits + summary.monitor.too_fast;
    o["over"] = run->is_over();
    o["reason"] = run->fault() ? std::string(run->look().reason) : run->fault().error().message;
    return o;
  }

  OperatorInterface& desk() { return run->desk(); }
};

PolicyTarget to_target(const Matrix4& T, std::optional<double> gripper) {
  PolicyTarget target;
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(T.data());
  if (matrix.allFinite()) {
    target.X_base_tool = to_pose(T.data(), "T_base_tool");
  } else {
    target.X_base_tool.p.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  target.gripper = gripper;
  return target;
}

}  // namespace

void bind_simulate(nb::module_& module) {
  nb::class_<Simulation>(module, "Simulation")
      .def("__init__",
           [](Simulation* self, const std::string& task, const std::string& robot, const std::string& profile,
              double rate) { new (self) Simulation(task, robot, profile, rate); })
      .def("begin", &Simulation::begin)
      .def("advance", &Simulation::advance)
      .def("observe", &Simulation::observe)
      .def("outcome", &Simulation::outcome)
      .def("connect", [](Simulation& s, const std::string& name,
                         double period) { check(s.desk().connect(PolicyInfo{name, period})); })
      .def("disconnect", [](Simulation& s) { check(s.desk().connect(std::nullopt)); })
      .def("turn",
           [](Simulation& s, bool on) {
             check(s.desk().apply({OperatorRequest::Kind::kPolicy, "", on ? 1.0 : 0.0}, s.run->now()));
           })
      .def(
          "target",
          [](Simulation& s, const Matrix4& T, std::optional<double> gripper) {
            s.desk().target(to_target(T, gripper), s.run->now());
          },
          nb::arg("T_base_tool"), nb::arg("gripper").none())
      .def(
          "hold",
          [](Simulation& s, const Matrix4& T, std::optional<double> gripper) {
            s.person = to_pose(T.data(), "T_base_hand");
            s.person_gripper = gripper;
          },
          nb::arg("T_base_hand"), nb::arg("gripper").none())
      .def("let_go",
           [](Simulation& s) {
             s.person.reset();
             s.operator_.reset();
           })
      .def("operate",
           [](Simulation& s, bool in_the_middle) {
             s.operator_ = in_the_middle ? ScriptedOperator::taking_over(s.stage.task, s.run->scene())
                                         : ScriptedOperator(s.stage.task);
           })
      .def("stop",
           [](Simulation& s) {
             check(s.desk().apply({.kind = OperatorRequest::Kind::kStop, .text = {}}, s.run->now()));
           })
      .def("reset",
           [](Simulation& s) {
             check(s.desk().apply({.kind = OperatorRequest::Kind::kReset, .text = {}}, s.run->now()));
           })
      .def_prop_ro("policy_turn", [](Simulation& s) { return s.desk().controls().policy_turn; })
      .def_prop_ro("operating", [](const Simulation& s) { return s.operator_ && !s.operator_->is_done(); })
      .def_prop_ro("instruction", [](const Simulation& s) { return s.stage.task.instruction; })
      .def_prop_ro("robot", [](const Simulation& s) { return s.stage.model.name; });
}

}  // namespace steadyhand::python
#else
#include "steadyhand/apps/python/module.hpp"

namespace steadyhand::python {

void bind_simulate(nb::module_& module) { module.attr("Simulation") = nb::none(); }

}  // namespace steadyhand::python
#endif
