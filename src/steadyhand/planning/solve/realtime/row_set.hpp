#pragma once

#include <limits>
#include <vector>

#include "steadyhand/planning/ocp/evaluation.hpp"

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

  /// Whether the bounds may be left at a cost.
  bool soft() const { return price < std::numeric_limits<double>::infinity(); }
};

/// All rows of an Ocp, in the order of Multipliers::index, and the working set of those that are computed at every
/// iterate. The others are checked only when these are satisfied.
class RowSet {
 public:
  explicit RowSet(const Ocp& ocp);

  int size() const { return static_cast<int>(rows_.size()); }
  const Row& operator[](int r) const { return rows_[r]; }
  /// Those whose value is an entry of z.
  const std::vector<int>& limits() const { return limits_; }
  /// In the order of insertion.
  const std::vector<int>& working_set() const { return working_set_; }
  bool in_working_set(int r) const { return in_working_set_[r]; }
  /// Leaves only the rows that are always in the working set.
  void reset();
  void add(int r);

 private:
  std::vector<Row> rows_;
  std::vector<int> limits_, always_, working_set_;
  std::vector<char> in_working_set_;
};

}  // namespace steadyhand::realtime
