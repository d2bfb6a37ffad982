#pragma once

#include <vector>

#include "steadyhand/planning/plan/obstacle_sweep.hpp"
#include "steadyhand/planning/plan/warm_start.hpp"

namespace steadyhand {

/// Selects the pairs of a body, or one of its corners, and an obstacle for the next problem, and their rows: those that
/// come nearest on the guess. An object that the tool carries is a body for other obstacles and an obstacle for the
/// arm's bodies. A pair that stays near keeps its row and the row's multipliers. The constructor allocates all memory.
class ObstacleRows {
 public:
  /// The Ocp must outlive it.
  explicit ObstacleRows(const Ocp& ocp);

  /// Fills instance.near and forgets the multipliers of rows that now have another pair.
  /// @pre instance.x0 and instance.clearance are set
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
    /// For a whole box to a box: whether somewhere on the guess the whole is nearer than all its corners. Otherwise the
    /// corners suffice, and the whole would repeat them with a derivative that jumps between edges while it lies flat.
    bool counts = true;
  };
  void add_pair(const ObstacleSweep& sweep, int body, int obstacle);
  void find_pairs(const ObstacleSweep& sweep, const Trajectory& guess, Kinematics& scratch);

  const Ocp& ocp_;
  int constraint_;            ///< index of theirs in Ocp::constraints(), where there are rows
  std::vector<Pair> pairs_;   ///< nearest first
  std::vector<Pair> by_row_;  ///< the pair of each row; body -1: none
  std::size_t used_ = 0;      ///< rows with a pair
};

}  // namespace steadyhand
