#include "steadyhand/planning/solve/realtime/model_layout.hpp"

#include <algorithm>

#include "steadyhand/planning/solve/realtime/transpose.hpp"

namespace steadyhand::realtime {

ModelLayout::ModelLayout() { sources_.reserve(static_cast<std::size_t>(kMaxEntries) * (kMaxEntries + 1 + 2 * kLanes)); }

void ModelLayout::set(int dof, const NodeHessianOf<Lanes>& H, const NodeGradientOf<Lanes>* g,
                      const NewtonSystem& newton) {
  const auto z_entry = [dof](int i) { return i < dof ? 2 * dof + i : i < 3 * dof ? i - dof : i; };
  entries_ = static_cast<int>(H.rows());
  width_ = newton.width();
  columns_ = g ? width_ : std::min(width_, (entries_ + kLanes - 1) / kLanes * kLanes);
  sources_.clear();
  for (int i = 0; i < entries_; ++i) {
    for (int j = i / kLanes * kLanes; j < columns_; ++j) {
      const Lanes* source = &zero_;
      if (g && j == newton.gradient()) {
        source = &(*g)[z_entry(i)];
      } else if (j >= i && j < entries_ && (i < 3 * dof) == (j < 3 * dof)) {
        const auto [first, second] = std::minmax({z_entry(i), z_entry(j)});
        source = &H(first, second);
      }
      sources_.push_back(source);
    }
  }
}

template <typename F>
void ModelLayout::move(const std::array<double*, kLanes>& models, int rows, const F& merge) const {
  const Lanes* const* source = sources_.data();
  for (int i = 0; i < rows; ++i) {
    for (int j = i / kLanes * kLanes; j < columns_; j += kLanes) {
      std::array<Lanes, kLanes> numbers;
#pragma GCC unroll 8
      for (int lane = 0; lane < kLanes; ++lane) numbers[lane] = *source[lane];
      source += kLanes;
      transpose(numbers);
#pragma GCC unroll 8
      for (int lane = 0; lane < kLanes; ++lane) {
        double* there = models[lane] + i * width_ + j;
        merge(there, numbers[lane]).store(there);
      }
    }
  }
}

void ModelLayout::write(const std::array<double*, kLanes>& models, int rows) const {
  move(models, rows, [](const double* /*there*/, Lanes numbers) { return numbers; });
}

void ModelLayout::add(const std::array<double*, kLanes>& models, int rows) const {
  move(models, rows, [](const double* there, Lanes numbers) { return Lanes::load(there) + numbers; });
}

}  // namespace steadyhand::realtime
