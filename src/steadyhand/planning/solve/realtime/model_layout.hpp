#pragma once

#include <array>
#include <vector>

#include "steadyhand/planning/ocp/term.hpp"
#include "steadyhand/planning/solve/realtime/riccati.hpp"

namespace steadyhand::realtime {

/// Where a node's model in a Riccati recursion finds its numbers in batches of kLanes nodes: by rows of
/// w = [u; q; dq; states of the liquids], in whole registers, starting with the one that holds the diagonal. The
/// constructor allocates all memory.
class ModelLayout {
 public:
  ModelLayout();

  /// The numbers are those of H, the upper triangle by z = [q; dq; u; states of the liquids] of all joints, and of g
  /// behind them; or of H alone, for the rows that it has. Both are later read at these addresses. No term combines a
  /// liquid and the arm.
  void set(const Riccati& riccati, const NodeHessianOf<Lanes>& H, const NodeGradientOf<Lanes>* g);

  /// Sets the first rows of these nodes' models.
  void write(const std::array<double*, kLanes>& models, int rows) const;
  /// Adds to them.
  void add(const std::array<double*, kLanes>& models, int rows) const;

 private:
  template <typename F>
  void move(const std::array<double*, kLanes>& models, int rows, const F& merge) const;

  int columns_ = 0, width_ = 0;
  std::vector<const Lanes*> sources_;
  Lanes zero_ = 0.0;
};

}  // namespace steadyhand::realtime
