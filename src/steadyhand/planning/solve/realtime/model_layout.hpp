#pragma once

#include <array>
#include <vector>

#include "steadyhand/planning/ocp/term.hpp"
#include "steadyhand/planning/solve/realtime/newton_system.hpp"

namespace steadyhand::realtime {

/// Where a node's model in a NewtonSystem finds its numbers in batches of kLanes nodes: by rows of
/// w = [u; q; dq; state of the liquid], in whole registers, starting with the one that holds the diagonal. The
/// constructor allocates all memory.
class ModelLayout {
 public:
  ModelLayout();

  /// The numbers are those of H, the upper triangle by z = [q; dq; u; state of the liquid], and of g behind them; or of
  /// H alone. Both are later read at these addresses. No term combines the liquid and the arm.
  void set(int dof, const NodeHessianOf<Lanes>& H, const NodeGradientOf<Lanes>* g, const NewtonSystem& newton);
  bool fits(const NodeHessianOf<Lanes>& H) const { return entries_ == H.rows(); }

  /// Sets the first rows of these nodes' models.
  void write(const std::array<double*, kLanes>& models, int rows) const;
  /// Adds to them.
  void add(const std::array<double*, kLanes>& models, int rows) const;

 private:
  template <typename F>
  void move(const std::array<double*, kLanes>& models, int rows, const F& merge) const;

  int entries_ = 0, columns_ = 0, width_ = 0;
  std::vector<const Lanes*> sources_;
  Lanes zero_ = 0.0;
};

}  // namespace steadyhand::realtime
