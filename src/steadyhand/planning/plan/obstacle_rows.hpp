#pragma once

#include <vector>

#include "steadyhand/planning/plan/obstacle_sweep.hpp"
#include "steadyhand/planning/plan/warm_start.hpp"

namespace steadyhand {

/// Which pairs of a body, or a corner of it, and an obstacle the next problem sees, and in which row: those that come
/// nearest on the guess. What the tool carries is a body to other obstacles, and an obstacle to the arm's bodies.
/// A pair that stays near keeps its row, so that the row's multipliers go on. Memory is taken by the constructor.
class ObstacleRows {
 public:
  /// The Ocp must outlive it.
  explicit ObstacleRows(const Ocp& ocp);

  /// Fills instance.near, whose x0 and clearance must be there, and forgets the multipliers of rows that stand for
  /// another pair now.
  /// @param start time of the instance's node 0
  void choose(const Obstacles& obstacles, Time start, Kinematics& scratch, WarmStart& warm_start,
              OcpInstance& instance);

 private:
  /// A pair that may come near.
  struct Pair {
    int body;  ///< as solid() takes it
    int obstacle;
    int corner;  ///< NearObstacle::corner
    double gap;  ///< m, the smallest on the guess
    /// Of a whole box to a box: whether somewhere on the guess no corner of it is as near. Else they tell all, and the
    /// whole would tell it again with a derivative that jumps from edge to edge while it lies flat.
    bool counts = true;
  };
  void add_pair(const ObstacleSweep& sweep, int body, int obstacle);
  void find_pairs(const ObstacleSweep& sweep, const Trajectory& guess, Kinematics& scratch);

  const Ocp& ocp_;
  int constraint_;            ///< index of theirs in Ocp::constraints(), where there are rows
  std::vector<Pair> pairs_;   ///< nearest first
  std::vector<Pair> by_row_;  ///< whose row it is; body -1: nobody's
  std::size_t used_ = 0;      ///< rows that are somebody's
};

}  // namespace steadyhand
