#include "steadyhand/apps/python/objective.hpp"

#include <nanobind/stl/shared_ptr.h>

#include <limits>
#include <utility>

namespace steadyhand::python {

PythonObjective::PythonObjective(const std::string& name, const std::string& unit, bool states, int weights,
                                 nb::object term)
    : Objective({.name = name,
                 .label = name,
                 .unit = unit,
                 .weights = {std::max(weights, 1), weights > 0 ? WeightCount::Of::kProblem : WeightCount::Of::kJoint}}),
      states_(states),
      term_(std::move(term)) {}

PythonObjective::~PythonObjective() {
  const nb::gil_scoped_acquire locked;
  error_ = nullptr;
  term_.reset();
}

/// False, once the term has raised something.
template <typename Take>
bool PythonObjective::call(const char* method, const Node& node, const JointVector& weight, const Take& take) const {
  const Locked locked;
  if (error_ || !term_) return false;
  try {
    const nb::object u = states_ ? nb::none() : nb::object(from_vector(node.u));
    take(term_.attr(method)(from_vector(node.arm.q()), from_vector(node.dq), u,
                            from_pose(node.reference->p, node.reference->R), from_vector(weight)));
    return true;
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
}

double PythonObjective::value(const Node& node, const JointVector& weight) const {
  double result = std::numeric_limits<double>::quiet_NaN();
  call("value", node, weight, [&](const nb::object& answer) { result = nb::cast<double>(answer); });
  return result;
}

void PythonObjective::add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const {
  const bool good = call("gradient", node, weight, [&](const nb::object& answer) {
    const auto row = nb::cast<Row>(answer);
    gradient += Eigen::Map<const Eigen::VectorXd>(row.data(), gradient.size());
  });
  if (!good) gradient.setConstant(std::numeric_limits<double>::quiet_NaN());
}

void PythonObjective::add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const {
  const bool good = call("hessian", node, weight, [&](const nb::object& answer) {
    const auto rows = nb::cast<Rows>(answer);
    const Eigen::Map<const Eigen::MatrixXd> symmetric(rows.data(), hessian.rows(), hessian.cols());
    hessian.triangularView<Eigen::Upper>() += symmetric;
  });
  if (!good) hessian.setConstant(std::numeric_limits<double>::quiet_NaN());
}

void PythonObjective::raise_error() const {
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

Objectives objectives_of(const nb::dict& options) {
  Objectives objectives;
  if (!options.contains("objectives")) return objectives;
  for (const nb::handle each : nb::cast<nb::list>(options["objectives"]))
    objectives.push_back(nb::cast<std::shared_ptr<PythonObjective>>(each));
  return objectives;
}

void raise_errors(const Objectives& objectives) {
  for (const auto& objective : objectives)
    if (const auto* in_python = dynamic_cast<const PythonObjective*>(objective.get())) in_python->raise_error();
}

int visit_objectives(const Objectives& objectives, visitproc visit, void* arg) {
  for (const auto& objective : objectives)
    if (const auto* in_python = dynamic_cast<const PythonObjective*>(objective.get()))
      Py_VISIT(nb::find(*in_python).ptr());
  return 0;
}

namespace {

int traverse_objective(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (nb::inst_ready(self)) Py_VISIT(nb::inst_ptr<PythonObjective>(self)->term().ptr());
  return 0;
}
int clear_objective(PyObject* self) {
  nb::inst_ptr<PythonObjective>(self)->clear();
  return 0;
}
PyType_Slot objective_slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(&traverse_objective)},
                                 {Py_tp_clear, reinterpret_cast<void*>(&clear_objective)},
                                 {0, nullptr}};

std::shared_ptr<PythonObjective> make_objective(const std::string& name, const std::string& unit, bool states,
                                                int weights, nb::object term) {
  return std::make_shared<PythonObjective>(name, unit, states, weights, std::move(term));
}

}  // namespace

void bind_objective(nb::module_& module) {
  nb::class_<PythonObjective>(module, "Objective", nb::type_slots(objective_slots)).def_static("make", &make_objective);
}

}  // namespace steadyhand::python
