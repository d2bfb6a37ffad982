#pragma once

#include <random>
#include <vector>

#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// The box of some joints in which a function of the arm's geometry is searched. One turn of a revolute joint
/// shows everything, so wider limits are cut to one turn about their middle.
class JointBox {
 public:
  /// @param joints their indices, in the order of the vectors here
  JointBox(const RobotModel& model, const std::vector<int>& joints);
  explicit JointBox(const RobotModel& model);  ///< all joints

  int size() const { return static_cast<int>(middle_.size()); }  ///< joints
  /// Anywhere in the box, evenly.
  JointVector sample(std::mt19937& random) const;

  /// Climbs `value(q)` by coordinate steps that halve when no step helps, until they are below 1e-7 of the box. Returns
  /// the place; q in the box before and after.
  template <typename Value>
  JointVector ascend(JointVector q, const Value& value) const {
    double best = value(q);
    for (double step = 0.25; step > 1e-7;) {
      bool better = false;
      for (int k = 0; k < size(); ++k) {
        for (const double direction : {1.0, -1.0}) {
          JointVector next = q;
          next[k] = clip(k, next[k] + direction * step * 2.0 * half_[k]);
          const double there = value(next);
          if (there > best) {
            best = there;
            q = next;
            better = true;
          }
        }
      }
      if (!better) step *= 0.5;
    }
    return q;
  }

 private:
  /// Full turns are walked around, other joints stop at their limits.
  double clip(int k, double q) const;

  JointVector middle_, half_;
  std::vector<bool> full_turn_;
};

}  // namespace steadyhand
