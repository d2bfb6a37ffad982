#pragma once

#include <exception>
#include <string>

#include "steadyhand/apps/python/module.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"
#include "steadyhand/planning/ocp/term.hpp"

namespace steadyhand::python {

/// An objective written in Python: `term` has value(q, dq, u, T_reference, weight), gradient(...) and hessian(...). It
/// is called under Python's lock, from the thread that solves. Its exception is kept, the solver sees NaN, and
/// raise_error() throws it where Python is the caller.
class PythonObjective final : public Objective {
 public:
  PythonObjective(const std::string& name, const std::string& unit, bool states, int weights, nb::object term);
  ~PythonObjective() override;
  PythonObjective(const PythonObjective&) = delete;
  PythonObjective& operator=(const PythonObjective&) = delete;

  Nodes nodes() const override { return states_ ? Nodes::kStates : Nodes::kIntervals; }
  using Objective::add_gradient;
  using Objective::add_hessian;
  using Objective::value;
  double value(const Node& node, const JointVector& weight) const override;
  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override;
  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override;

  /// Under Python's lock.
  void raise_error() const;
  /// For Python's search for cycles: the term may hold what holds this.
  nb::handle term() const { return term_; }
  void clear() { term_.reset(); }

 private:
  template <typename Take>
  bool call(const char* method, const Node& node, const JointVector& weight, const Take& take) const;

  bool states_;
  nb::object term_;
  mutable std::exception_ptr error_;  ///< under Python's lock
};

/// As the keyword arguments have them.
Objectives objectives_of(const nb::dict& options);
/// Raises what those of Python among the terms have raised. Under Python's lock.
void raise_errors(const Objectives& objectives);
/// For tp_traverse of what owns the terms.
int visit_objectives(const Objectives& objectives, visitproc visit, void* arg);

}  // namespace steadyhand::python
