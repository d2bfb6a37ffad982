#include "steadyhand/solve/realtime/row_set.hpp"

#include <cmath>

namespace steadyhand::realtime {

RowSet::RowSet(const Ocp& ocp) : horizon_(ocp.horizon()) {
  int first_slots = 0, last_slots = 0;
  for (int c = 0; c < std::ssize(ocp.constraints()); ++c) {
    const Constraint& constraint = *ocp.constraints()[c];
    const bool of_state = constraint.nodes() == Nodes::kStates;
    for (int i = 0; i < constraint.rows(); ++i) {
      rows_.push_back({{c, i},
                       constraint.nodes(),
                       constraint.bounds(i),
                       constraint.entry(i),
                       constraint.support(i, ocp.dof()),
                       constraint.activation_margin(i),
                       constraint.price(i)});
      slot_first_.push_back(of_state ? -1 : first_slots++);
      slot_last_.push_back(of_state ? last_slots++ : -1);
    }
  }
  in_working_set_.resize(rows_.size());
  working_set_.reserve(rows_.size());
  reset();
}

void RowSet::reset() {
  working_set_.clear();
  for (int r = 0; r < size(); ++r) {
    in_working_set_[r] = !std::isfinite(rows_[r].activation_margin);
    if (in_working_set_[r]) working_set_.push_back(r);
  }
}

void RowSet::add(int r) {
  if (in_working_set_[r]) return;
  in_working_set_[r] = true;
  working_set_.push_back(r);
}

}  // namespace steadyhand::realtime
