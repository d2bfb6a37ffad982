#pragma once

#include <utility>
#include <vector>

#include "core/math.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

namespace steadyhand {

/// How long after a joint was told to be somewhere it is measured there, from a motion with ups and downs.
class DelayMeter {
 public:
  void command(Time made, double q) { commands_.emplace_back(made, q); }
  void measure(Time at, double q) { measured_.emplace_back(at, q); }
  /// s, to a tenth of a millisecond; fails if the joint did not do what it was told. After at least a second of
  /// commands.
  Result<double> delay() const;

 private:
  double error(double delay) const;
  std::vector<std::pair<Time, double>> commands_, measured_;
};

}  // namespace steadyhand
