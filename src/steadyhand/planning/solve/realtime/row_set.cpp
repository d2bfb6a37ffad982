#include "steadyhand/planning/solve/realtime/row_set.hpp"

#include <cmath>

namespace steadyhand::realtime {

RowSet::RowSet(const Ocp& ocp) {
  for (int c = 0; c < std::ssize(ocp.constraints()); ++c) {
    const Constraint& constraint = *ocp.constraints()[c];
    for (int i = 0; i < constraint.rows(); ++i) {
      rows_.push_back({{c, i},
                       constraint.nodes(),
                       constraint.bounds(i),
                       constraint.entry(i),
                       constraint.support(i, ocp.dof()),
                       constraint.activation_margin(i),
                       constraint.price(i)});
      if (rows_.back().entry >= 0) limits_.push_back(size() - 1);
    }
  }
  for (int r = 0; r < size(); ++r) {
    if (!std::isfinite(rows_[r].activation_margin)) always_.push_back(r);
  }
  in_working_set_.assign(rows_.size(), 0);
  working_set_.reserve(rows_.size());
  reset();
}

void RowSet::reset() {
  for (const int r : working_set_) in_working_set_[r] = 0;
  working_set_.clear();
  for (const int r : always_) add(r);
}

void RowSet::add(int r) {
  if (in_working_set_[r]) return;
  in_working_set_[r] = 1;
  working_set_.push_back(r);
}

}  // namespace steadyhand::realtime
