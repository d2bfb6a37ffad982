#pragma once

#include <random>

#include "sequences.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/planning/plan/obstacle_rows.hpp"
#include "steadyhand/planning/plan/warm_start.hpp"
#include "steadyhand/planning/predict/predictor.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand::bench {

/// A planner without its checks: solves along a sequence, each time from where the last solution ends, and lets a
/// caller look at each solve. If the solver finds nothing feasible, the arm brakes, even if its bodies collide. After a
/// second of braking it starts again at home.
class ClosedLoop {
 public:
  /// @param obstacles of which the problem sees as many pairs as it has rows for
  ClosedLoop(const Ocp& ocp, const std::vector<JointVector>& weights, const Sequence& sequence, const Reach& reach,
             const Obstacles& obstacles, unsigned seed);

  /// The next problem with its warm start: read them, solve into solution(), then call advance().
  void pose();
  void advance();

  const Ocp& ocp() const { return ocp_; }
  const OcpInstance& instance() const { return instance_; }
  const WarmStart& warm_start() const { return warm_start_; }
  Solution& solution() { return solution_; }
  double choosing_us() const { return choosing_us_; }  ///< which pairs with obstacles the problem sees

 private:
  const Ocp& ocp_;
  const Sequence& sequence_;
  std::mt19937 random_;
  Obstacles obstacles_;
  ObstacleRows obstacle_rows_;
  Kinematics arm_;
  double choosing_us_ = 0.0;
  Predictor predictor_;
  WarmStart warm_start_;
  OcpInstance instance_;
  Solution solution_;
  Trajectory followed_;
  Time followed_start_{0};
  std::int64_t step_ = 0, sample_ = 0, lost_ = 0;  ///< lost_: solves in a row that found nothing feasible
};

}  // namespace steadyhand::bench
