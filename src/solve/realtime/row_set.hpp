#pragma once

#include <vector>

#include "ocp/evaluation.hpp"

namespace steadyhand::realtime {

/// One scalar inequality at all nodes where its constraint acts.
struct Row {
  ConstraintRow id;
  Bounds bounds;
  int first, last;      ///< nodes, inclusive
  int entry;            ///< see Constraint::entry
  double watch_margin;  ///< see Constraint::watch_margin
};

/// All rows of an Ocp, in the order of Evaluation::rows, and which of them are watched: computed at every iterate. The
/// others are only looked at when the watched ones are satisfied.
class RowSet {
 public:
  explicit RowSet(const Ocp& ocp);

  int size() const { return static_cast<int>(rows_.size()); }
  const Row& operator[](int r) const { return rows_[r]; }
  /// Index of row r in Evaluation::rows(k). @pre rows_[r].first <= k <= rows_[r].last
  int slot(int r, int k) const { return k == 0 ? slot_first_[r] : k == horizon_ ? slot_last_[r] : r; }

  const std::vector<int>& watched() const { return watched_; }
  bool is_watched(int r) const { return is_watched_[r]; }
  /// Leaves only the rows that are always watched.
  void reset();
  void watch(int r);

 private:
  int horizon_;
  std::vector<Row> rows_;
  std::vector<int> slot_first_, slot_last_;
  std::vector<int> watched_;
  std::vector<char> is_watched_;
};

}  // namespace steadyhand::realtime
