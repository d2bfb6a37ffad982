#pragma once

#include <limits>
#include <vector>

#include "steadyhand/ocp/evaluation.hpp"

namespace steadyhand::realtime {

/// One scalar inequality at all nodes where its constraint acts.
struct Row {
  ConstraintRow id;
  Nodes nodes;
  Bounds bounds;
  int entry;                 ///< see Constraint::entry
  EntryRange support;        ///< see Constraint::support
  double activation_margin;  ///< see Constraint::activation_margin
  double price;              ///< see Constraint::price

  /// Whether leaving the bounds costs something but is allowed.
  bool soft() const { return price < std::numeric_limits<double>::infinity(); }
};

/// All rows of an Ocp, in the order of Evaluation::rows, and the working set of those that are computed at every
/// iterate. The others are only looked at when these are satisfied.
class RowSet {
 public:
  explicit RowSet(const Ocp& ocp);

  int size() const { return static_cast<int>(rows_.size()); }
  const Row& operator[](int r) const { return rows_[r]; }
  /// Nodes first(r) .. last(r) are those where row r acts.
  int first(int r) const { return rows_[r].nodes == Nodes::kStates ? 1 : 0; }
  int last(int r) const { return rows_[r].nodes == Nodes::kStates ? horizon_ : horizon_ - 1; }
  /// Index of row r in Evaluation::rows(k). @pre first(r) <= k <= last(r)
  int slot(int r, int k) const { return k == 0 ? slot_first_[r] : k == horizon_ ? slot_last_[r] : r; }

  const std::vector<int>& working_set() const { return working_set_; }
  bool in_working_set(int r) const { return in_working_set_[r]; }
  /// Leaves only the rows that are always in the working set.
  void reset();
  void add(int r);

 private:
  int horizon_;
  std::vector<Row> rows_;
  std::vector<int> slot_first_, slot_last_;
  std::vector<int> working_set_;
  std::vector<char> in_working_set_;
};

}  // namespace steadyhand::realtime
