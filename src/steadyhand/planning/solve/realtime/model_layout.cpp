#include "steadyhand/planning/solve/realtime/model_layout.hpp"

#include <algorithm>

#include "steadyhand/planning/solve/realtime/transpose.hpp"

namespace steadyhand::realtime {

ModelLayout::ModelLayout() { sources_.reserve(static_cast<std::size_t>(kMaxEntries) * (kMaxEntries + 1 + 2 * kLanes)); }

void ModelLayout::set(const Riccati& riccati, const NodeHessianOf<Lanes>& H, const NodeGradientOf<Lanes>* g) {
  const std::vector<int>& entries = riccati.entries();
  const int of_arm = 3 * riccati.joints().dof, rows = g ? riccati.size() : of_arm;
  width_ = riccati.width();
  columns_ = g ? width_ : std::min(width_, (rows + kLanes - 1) / kLanes * kLanes);
  sources_.clear();
  for (int i = 0; i < rows; ++i) {
    for (int j = i / kLanes * kLanes; j < columns_; ++j) {
      const Lanes* source = &zero_;
      if (g && j == riccati.gradient()) {
        source = &(*g)[entries[i]];
      } else if (j >= i && j < rows && (i < of_arm) == (j < of_arm)) {
        const auto [first, second] = std::minmax({entries[i], entries[j]});
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
