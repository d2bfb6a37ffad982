#include <fmt/format.h>
#include <nanobind/stl/map.h>

#include <atomic>
#include <memory>

#include "steadyhand/apps/python/objective.hpp"
#include "steadyhand/apps/python/options.hpp"
#include "steadyhand/apps/python/robot.hpp"
#include "steadyhand/files/record/step.hpp"
#include "steadyhand/planning/plan/active_constraint.hpp"

namespace steadyhand::python {

namespace {

/// A plan and what came with it.
struct PlanResult {
  Plan plan;
  int nodes = 0;  ///< N
  ActiveConstraint active;
  PlanFault fault = PlanFault::kNone;
  double solve_us = 0.0, objective = 0.0;
  int iterations = 0;
};

/// One user of a pipeline at a time: Python's lock is released while it plans.
class Turn {
 public:
  explicit Turn(std::atomic_flag& busy) : busy_(busy) {
    if (busy_.test_and_set()) throw Refused("another thread is using this object; give each thread its own object");
  }
  ~Turn() { busy_.clear(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  std::atomic_flag& busy_;
};

nb::tuple to_tuple(const JointCommand& command) {
  return nb::make_tuple(from_vector(command.q), from_vector(command.dq), from_vector(command.ddq));
}

/// Common parts of Python's Planner and Pipeline.
class Stages {
 public:
  Stages(const Robot& robot, const PipelineSettings& settings, const Cell& cell)
      : cell_(cell),
        obstacles_(settings.planner.obstacles),
        pipeline_(value_of(Pipeline::make(*robot.model, settings))),
        weights_(settings.ocp.weights),
        arm_(pipeline_->model()),
        reaches_(compute_reaches(pipeline_->model())) {}

  /// The target of each tool, for the predictors.
  void aim(const Matrices4& T_base_tool, double t, const std::vector<bool>& engaged) {
    const Turn turn(busy_);
    const Time now = to_time(t, "t");
    PerTool<Pose> poses;
    for (int i = 0; i < tools(); ++i) poses[i] = to_pose(T_base_tool.data() + 16 * i, "T_base_tool");
    for (int i = 0; i < tools(); ++i) {
      pipeline_->predictor(i).update({{now, now}, poses[i], engaged[static_cast<std::size_t>(i)], Time(0)});
    }
  }

  /// The hand that moves a tool, for its retargeter.
  void feed(const Matrix4& T_operator_hand, double t, bool clutch, int tool) {
    const Turn turn(busy_);
    const Time now = to_time(t, "t");
    OperatorSample sample{{now, now}, to_pose(T_operator_hand.data(), "T_operator_hand"), clutch};
    sample.tool = tool;
    check(pipeline_->feed(sample));
  }

  PlanResult plan(double t) {
    const Turn turn(busy_);
    const Time now = advance(t);
    {
      const Unlocked unlocked;
      pipeline_->plan(now);
    }
    raise_errors(objectives());
    return result();
  }

  /// Poses of all nodes for the first tool, then for the next.
  PlanResult follow(const Matrices4& T_base_tool, double t) {
    const Turn turn(busy_);
    Planner& planner = pipeline_->planner();
    const auto nodes = static_cast<int>(T_base_tool.shape(0)) / tools();
    Reference reference;
    for (int i = 0; i < tools() * nodes; ++i) {
      const Pose pose = to_pose(T_base_tool.data() + 16 * i, "T_base_tool");
      reference.tools[i / nodes].p[i % nodes] = pose.p;
      reference.tools[i / nodes].R[i % nodes] = pose.q.toRotationMatrix();
    }
    const Time now = advance(t);
    reference.stamp = {now, now};
    reference.start = now;
    reference.dt = planner.ocp().dt();
    reference.nodes = nodes;
    {
      const Unlocked unlocked;
      planner.update(reference);
    }
    raise_errors(objectives());
    return result();
  }

  nb::tuple update(double t) {
    const Turn turn(busy_);
    const Time now = to_time(t, "t");
    const JointCommand command = [&] {
      const Unlocked unlocked;
      return pipeline_->update(now);
    }();
    raise_errors(objectives());
    return to_tuple(command);
  }

  PlanResult last_plan() {
    const Turn turn(busy_);
    return result();
  }

  void reset(const Row& q, double t) {
    const Turn turn(busy_);
    const Time now = to_time(t, "t");
    check(pipeline_->reset(to_joints(q), now));
    last_ = now;
  }

  /// @param t s, when moving objects are at their given poses
  void set_cell(const Cell& cell, double t) {
    const Turn turn(busy_);
    Obstacles obstacles = value_of(obstacles_of(cell, pipeline_->model()));
    obstacles.time = to_time(t, "t");
    if (obstacles.count > 0 && pipeline_->planner().ocp().obstacle_rows() == 0)
      throw Refused("it was made without a cell; cell=[] says that there will be one");
    check(pipeline_->planner().set_obstacles(obstacles));
    obstacles_ = obstacles;
    cell_ = cell;
  }
  nb::list object_names() const {
    nb::list names;
    for (const CellObject& object : cell_.objects) names.append(to_text(object.name));
    return names;
  }

  /// Those that are not named stay.
  void set_weights(const Weights& weights) {
    const Turn turn(busy_);
    Weights all = weights_;
    for (const auto& [name, values] : weights) all[name] = values;
    const auto checked = value_of(pipeline_->planner().ocp().weights(all));
    pipeline_->planner().set_weights(checked);
    weights_ = std::move(all);
  }

  /// As vectors, of all terms.
  nb::dict weights() const {
    const Planner& planner = pipeline_->planner();
    nb::dict result;
    for (std::size_t i = 0; i < planner.ocp().objectives().size(); ++i) {
      const std::string name(planner.ocp().objectives()[i]->name());
      result[name.c_str()] = from_vector(planner.instance().weights[i]);
    }
    return result;
  }

  nb::tuple target(int tool) const {
    const Target& target = pipeline_->target(tool);
    return nb::make_tuple(from_pose(target.X_base_tool.p, target.X_base_tool.q.toRotationMatrix()), target.engaged);
  }
  int tools() const { return pipeline_->model().tool_count(); }
  void set_scale(double scale) { for_each_hand(&Retargeter::set_scale, scale); }
  void set_yaw(double yaw) { for_each_hand(&Retargeter::set_yaw, yaw); }
  void set_tilt(double tilt) { for_each_hand(&Retargeter::set_tilt_max, to_tilt(tilt)); }
  void set_no_spill(bool on) {
    if (on && !pipeline_->planner().ocp().liquid()) throw Refused("no_spill: the profile knows no liquid");
    pipeline_->planner().set_no_spill(on);
  }
  void release() { for_each_hand(&Retargeter::release); }
  const Objectives& objectives() const { return pipeline_->planner().ocp().objectives(); }
  int horizon() const { return pipeline_->planner().ocp().horizon(); }
  double dt() const { return pipeline_->planner().ocp().dt(); }

 private:
  template <typename Call, typename... Values>
  void for_each_hand(Call call, Values... values) {
    for (int i = 0; i < tools(); ++i) (pipeline_->retargeter(i).*call)(values...);
  }
  Time advance(double t) {
    const Time now = to_time(t, "t");
    if (now < last_)
      throw Refused(
          fmt::format("t is {} s, before {} s of the last plan; times must not go back", t, to_seconds(last_)));
    return last_ = now;
  }

  PlanResult result() {
    const Planner& planner = pipeline_->planner();
    const Solution& solution = planner.solution();
    const int nodes = planner.ocp().horizon();
    return {planner.plan(),
            nodes,
            active_constraint(planner.plan(), nodes, planner.instance(), reaches_, arm_, obstacles_),
            planner.fault(),
            solution.time_us,
            solution.objective,
            solution.iterations};
  }

  Cell cell_;
  Obstacles obstacles_;  ///< its objects
  std::unique_ptr<Pipeline> pipeline_;
  Weights weights_;
  Kinematics arm_;
  std::vector<Reach> reaches_;
  std::atomic_flag busy_;
  Time last_{Time::min()};
};

std::unique_ptr<Stages> make_stages(const Robot& robot, const std::string& profile, const nb::dict& options) {
  PipelineSettings settings = pipeline_settings(*robot.model, profile, options);
  Cell cell;
  if (options.contains("cell")) {
    cell = nb::cast<const Cell&>(options["cell"]);
    settings.planner.obstacles = value_of(obstacles_of(cell, *robot.model));
    settings.ocp.obstacle_rows = kUsualObstacleRows;
  }
  const Unlocked unlocked;
  return std::make_unique<Stages>(robot, settings, cell);
}

int traverse_stages(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  return nb::inst_ready(self) ? visit_objectives(nb::inst_ptr<Stages>(self)->objectives(), visit, arg) : 0;
}
PyType_Slot stages_slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(&traverse_stages)}, {0, nullptr}};

/// Rows k of `count`, each from `entry(k)`.
template <typename Entry>
nb::object rows(int count, int columns, const Entry& entry) {
  double* data = nullptr;
  nb::object array = make_array({static_cast<std::size_t>(count), static_cast<std::size_t>(columns)}, data);
  for (int k = 0; k < count; ++k) Eigen::Map<Eigen::VectorXd>(data + k * columns, columns) = entry(k);
  return array;
}
nb::object positions(const PlanResult& result) {
  const Plan& plan = result.plan;
  return rows(plan.intervals + 1, plan.joints, [&](int k) { return plan.x[k].head(plan.joints); });
}
nb::object velocities(const PlanResult& result) {
  const Plan& plan = result.plan;
  return rows(plan.intervals + 1, plan.joints, [&](int k) { return plan.x[k].tail(plan.joints); });
}
nb::object accelerations(const PlanResult& result) {
  const Plan& plan = result.plan;
  return rows(plan.intervals, plan.joints, [&](int k) { return plan.u[k]; });
}

}  // namespace

void bind_planner(nb::module_& module) {
  using P = PlanResult;
  nb::class_<P>(module, "Plan")
      .def_prop_ro("q", &positions)
      .def_prop_ro("dq", &velocities)
      .def_prop_ro("ddq", &accelerations)
      .def_prop_ro("dt", [](const P& r) { return r.plan.dt; })
      .def_prop_ro("start", [](const P& r) { return to_seconds(r.plan.start); })
      .def_ro("nodes", &P::nodes)
      .def_prop_ro("status", [](const P& r) { return to_text(to_string(r.plan.origin)); })
      .def_prop_ro("active", [](const P& r) { return to_text(to_string(r.active.kind)); })
      .def_prop_ro("active_between", [](const P& r) { return nb::make_tuple(r.active.first, r.active.second); })
      .def_prop_ro("fault", [](const P& r) { return to_text(to_string(r.fault)); })
      .def_ro("solve_us", &P::solve_us)
      .def_ro("objective", &P::objective)
      .def_ro("iterations", &P::iterations)
      .def("at", [](const P& r, double t) { return to_tuple(sample(r.plan, to_time(t, "t"))); });
  nb::class_<Stages>(module, "Stages", nb::type_slots(stages_slots))
      .def_static("make", &make_stages)
      .def("aim", &Stages::aim)
      .def("feed", &Stages::feed)
      .def("plan", &Stages::plan)
      .def("follow", &Stages::follow)
      .def("update", &Stages::update)
      .def("last_plan", &Stages::last_plan)
      .def("reset", &Stages::reset)
      .def("set_cell", &Stages::set_cell)
      .def_prop_ro("object_names", &Stages::object_names)
      .def("set_weights", &Stages::set_weights)
      .def_prop_ro("weights", &Stages::weights)
      .def("target", &Stages::target)
      .def("set_scale", &Stages::set_scale)
      .def("set_yaw", &Stages::set_yaw)
      .def("set_tilt", &Stages::set_tilt)
      .def("set_no_spill", &Stages::set_no_spill)
      .def("release", &Stages::release)
      .def_prop_ro("horizon", &Stages::horizon)
      .def_prop_ro("dt", &Stages::dt);
}

}  // namespace steadyhand::python
