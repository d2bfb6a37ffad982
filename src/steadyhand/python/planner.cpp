#include <fmt/format.h>

#include <atomic>
#include <memory>

#include "steadyhand/pipeline/pipeline.hpp"
#include "steadyhand/plan/active_constraint.hpp"
#include "steadyhand/python/module.hpp"
#include "steadyhand/python/robot.hpp"

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
    if (busy_.test_and_set()) throw Refused("another thread is using this object; give each thread one of its own");
  }
  ~Turn() { busy_.clear(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  std::atomic_flag& busy_;
};

class Stages {
 public:
  Stages(const Robot& robot, const PipelineSettings& settings)
      : pipeline_(value_of(Pipeline::make(*robot.model, settings))),
        arm_(pipeline_->model()),
        reach_(compute_reach(pipeline_->model())) {}

  void aim(const Matrix4& T_base_tool, double t, bool engaged) {
    const Turn turn(busy_);
    const Time now = to_time(t, "t");
    pipeline_->predictor().update({{now, now}, to_pose(T_base_tool.data(), "T_base_tool"), engaged, Time(0)});
  }

  PlanResult plan(double t) {
    const Turn turn(busy_);
    const Time now = to_time(t, "t");
    if (now < last_)
      throw Refused(fmt::format("t is {} s, before {} s of the last plan; times must not go back", t, to_seconds(last_)));
    last_ = now;
    const nb::gil_scoped_release unlocked;
    pipeline_->plan(now);
    const Planner& planner = pipeline_->planner();
    const Solution& solution = planner.solution();
    const int nodes = planner.ocp().horizon();
    return {planner.plan(), nodes,          active_constraint(planner.plan(), nodes, planner.instance().reference, reach_, arm_),
            planner.fault(), solution.time_us, solution.objective,
            solution.iterations};
  }

 private:
  std::unique_ptr<Pipeline> pipeline_;
  Kinematics arm_;
  Reach reach_;
  std::atomic_flag busy_;
  Time last_{Time::min()};
};

std::unique_ptr<Stages> make(const Robot& robot, const std::string& profile) {
  const nb::gil_scoped_release unlocked;
  return std::make_unique<Stages>(robot, PipelineSettings(value_of(load_profile(profile))));
}

/// Of the plan's nodes: `count` rows, each from `entry(k)`.
template <typename Entry>
nb::object rows(int count, int columns, const Entry& entry) {
  double* data = nullptr;
  nb::object array = make_array({static_cast<std::size_t>(count), static_cast<std::size_t>(columns)}, data);
  for (int k = 0; k < count; ++k) Eigen::Map<Eigen::VectorXd>(data + k * columns, columns) = entry(k);
  return array;
}

std::string_view name_of(PlanOrigin origin) {
  return origin == PlanOrigin::kSolved ? "solved" : origin == PlanOrigin::kFeasible ? "feasible" : "previous";
}

nb::str text(std::string_view view) { return nb::str(view.data(), view.size()); }

}  // namespace

void bind_planner(nb::module_& module) {
  nb::class_<PlanResult>(module, "Plan")
      .def_prop_ro("q", [](const PlanResult& r) { return rows(r.plan.intervals + 1, r.plan.joints, [&](int k) { return r.plan.x[k].head(r.plan.joints); }); })
      .def_prop_ro("dq", [](const PlanResult& r) { return rows(r.plan.intervals + 1, r.plan.joints, [&](int k) { return r.plan.x[k].tail(r.plan.joints); }); })
      .def_prop_ro("ddq", [](const PlanResult& r) { return rows(r.plan.intervals, r.plan.joints, [&](int k) { return r.plan.u[k]; }); })
      .def_prop_ro("dt", [](const PlanResult& r) { return r.plan.dt; })
      .def_prop_ro("start", [](const PlanResult& r) { return to_seconds(r.plan.start); })
      .def_ro("nodes", &PlanResult::nodes)
      .def_prop_ro("status", [](const PlanResult& r) { return text(name_of(r.plan.origin)); })
      .def_prop_ro("active", [](const PlanResult& r) { return text(to_string(r.active.kind)); })
      .def_prop_ro("active_between", [](const PlanResult& r) { return nb::make_tuple(r.active.first, r.active.second); })
      .def_prop_ro("fault", [](const PlanResult& r) { return text(to_string(r.fault)); })
      .def_ro("solve_us", &PlanResult::solve_us)
      .def_ro("objective", &PlanResult::objective)
      .def_ro("iterations", &PlanResult::iterations)
      .def("at", [](const PlanResult& r, double t) {
        const JointCommand command = sample(r.plan, to_time(t, "t"));
        return nb::make_tuple(from_vector(command.q), from_vector(command.dq), from_vector(command.ddq));
      });
  nb::class_<Stages>(module, "Stages")
      .def_static("make", &make)
      .def("aim", &Stages::aim)
      .def("plan", &Stages::plan);
}

}  // namespace steadyhand::python
