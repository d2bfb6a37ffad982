#pragma once

#include <vector>

#include "steadyhand/core/lanes.hpp"

namespace steadyhand::realtime {

/// Order of the nodes k = 0..N side by side in memory, kLanes to a batch: 1, 2, .. N, then 0, which few terms need,
/// then padding that repeats node 0.
struct NodeOrder {
  int horizon;

  int column(int k) const { return k == 0 ? horizon : k - 1; }
  /// Node of a column; 0 for padding.
  int node(int column) const { return column < horizon ? column + 1 : 0; }
  int batches() const { return (horizon + kLanes) / kLanes; }
  int columns() const { return batches() * kLanes; }
};

/// Numbers by (row, node), a row's nodes side by side: an operation on a row acts on kLanes of its nodes at once.
class NodeTable {
 public:
  NodeTable(int rows, NodeOrder order)
      : order_(order), batches_(order.batches()), lanes_(static_cast<std::size_t>(rows) * batches_, Lanes(0.0)) {}

  /// Batches of a row.
  Lanes* operator[](int row) { return lanes_.data() + static_cast<std::size_t>(row) * batches_; }
  const Lanes* operator[](int row) const { return lanes_.data() + static_cast<std::size_t>(row) * batches_; }

  double at(int row, int k) const {
    const int column = order_.column(k);
    return (*this)[row][column / kLanes][column % kLanes];
  }
  void set(int row, int k, double value) {
    const int column = order_.column(k);
    (*this)[row][column / kLanes].set(column % kLanes, value);
  }

  int batches() const { return batches_; }
  NodeOrder order() const { return order_; }

  /// *this = a + scale * b, of the same shape.
  void set_sum(const NodeTable& a, double scale, const NodeTable& b) {
    for (std::size_t i = 0; i < lanes_.size(); ++i) lanes_[i] = a.lanes_[i] + scale * b.lanes_[i];
  }

 private:
  NodeOrder order_;
  int batches_;
  std::vector<Lanes> lanes_;
};

}  // namespace steadyhand::realtime
