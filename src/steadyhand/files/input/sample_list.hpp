#pragma once

#include <string>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Collects the samples of one recording and refuses those that no hand can have made. Both readers feed it, so both
/// formats obey the same rules.
class SampleList {
 public:
  /// Values of the file, in robot axes.
  struct Row {
    double t = 0.0;  ///< s
    Vector3 p = Vector3::Zero();
    Quaternion q = Quaternion::Identity();
    bool clutch = true;
  };

  /// Times count from the first row, and increase for each hand. `where` goes before the message: the file and the line
  /// or key. @param tool which the hand moves, below kMaxTools
  Status add(const Row& row, const std::string& where, int tool = 0);

  std::size_t count(int tool) const { return hands_[tool].count; }  ///< rows of this hand

  /// The samples of [from, until] (s) after the first of all, in order of time, their times counted from the first of
  /// them. `where`: the file.
  Result<std::vector<OperatorSample>> take(double from, double until, const std::string& where) &&;

 private:
  std::vector<OperatorSample> samples_;
  double start_ = 0.0;  ///< s, the first row's time
  struct Hand {
    std::size_t count = 0;  ///< of its samples
    double previous = 0.0;  ///< s, the last row's time
    Time newest{0};         ///< of its samples
  };
  PerTool<Hand> hands_;
};

}  // namespace steadyhand
