#pragma once

#include <algorithm>
#include <vector>

namespace steadyhand::realtime {

/// Numbers by (row, node k = 0..N), a row's nodes side by side in memory: what is done to one row is done to all its
/// nodes at once.
class NodeTable {
 public:
  NodeTable(int rows, int stride) : stride_(stride), numbers_(static_cast<std::size_t>(rows) * stride, 0.0) {}

  double* operator[](int row) { return numbers_.data() + static_cast<std::size_t>(row) * stride_; }
  const double* operator[](int row) const { return numbers_.data() + static_cast<std::size_t>(row) * stride_; }
  int stride() const { return stride_; }
  double* begin() { return numbers_.data(); }
  double* end() { return numbers_.data() + numbers_.size(); }
  const double* begin() const { return numbers_.data(); }
  const double* end() const { return numbers_.data() + numbers_.size(); }

  /// *this = a + scale * b, of the same shape.
  void set_sum(const NodeTable& a, double scale, const NodeTable& b) {
    for (std::size_t i = 0; i < numbers_.size(); ++i) numbers_[i] = a.numbers_[i] + scale * b.numbers_[i];
  }

 private:
  int stride_;
  std::vector<double> numbers_;
};

}  // namespace steadyhand::realtime
