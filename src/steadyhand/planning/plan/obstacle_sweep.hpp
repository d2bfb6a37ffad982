#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"

namespace steadyhand {

/// A length for each of n + 1 links.
using LinkLengths = Eigen::Array<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints + 1, 1>;
/// Some of the links.
using LinkMask = Eigen::Array<bool, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints + 1, 1>;

/// Which bodies of the arm, and of the objects it carries (solid_of), may come near which obstacles on a motion. The
/// test uses boxes around the path of each, aligned with the base's axes. Pairs that it excludes are not near; the
/// others may be. Allocates nothing.
class ObstacleSweep {
 public:
  /// @param start time of the motion's beginning; the obstacles must outlive it
  ObstacleSweep(const RobotModel& model, const Obstacles& obstacles, Time start);

  /// Adds a position of the arm on the motion. Call set_position before.
  void pass(const Kinematics& arm);
  /// Finds each pair whose boxes are nearer than `margin` (m) in a motion of `duration` (s), on which no point of a
  /// link is ever further than `stray` (m) from the positions of pass().
  void find(double duration, double margin, const LinkLengths& stray);
  /// Notes which pairs from find() overlap by more than `overlap` (m) at the motion's beginning, where the arm is now.
  /// Call set_position before.
  void note_entered(const Kinematics& arm, double overlap);

  const Obstacles& obstacles() const { return *obstacles_; }  ///< all of them
  int count() const { return obstacles_->count; }             ///< of obstacles
  const LinkLengths& fastest() const { return fastest_; }     ///< m/s, of the obstacles from find(), by link
  /// Shape of the obstacle, with its margin.
  const Shape& shape(int obstacle) const { return obstacles_->list[obstacle].shape; }
  /// Its pose in the base, t (s) after the motion's beginning.
  Placed placed(int obstacle, double t) const { return placed_after(obstacles_->list[obstacle], since_ + t); }
  /// Whether it has a velocity.
  bool moves(int obstacle) const { return !obstacles_->list[obstacle].velocity.isZero(0.0); }
  /// Whether the body overlaps it at the motion's beginning (note_entered).
  bool entered(int body, int obstacle) const { return (entered_[body] >> obstacle & 1) != 0; }
  /// As it is at the motion's beginning.
  Obstacle at_start(int obstacle) const;

  /// Calls f(body, obstacle) with each pair from find(); carried objects are never the obstacle.
  template <typename F>
  void for_each_near(const F& f) const {
    for_each_solid(*model_, *obstacles_, [&](int body) {
      for (std::uint64_t left = near_[body]; left != 0; left &= left - 1) f(body, std::countr_zero(left));
    });
  }

 private:
  using Box = Eigen::AlignedBox3d;
  bool may_meet(const Box& body, const Obstacle& obstacle, double duration, double margin) const;

  const RobotModel* model_;
  const Obstacles* obstacles_;
  LinkLengths fastest_;
  double since_;  ///< s, from the obstacles' time to the motion's beginning
  std::array<Box, kMaxSolids> ways_;
  std::array<std::uint64_t, kMaxSolids> near_{};     ///< bit o of a body: obstacle o
  std::array<std::uint64_t, kMaxSolids> entered_{};  ///< likewise
  static_assert(Obstacles::kMost <= 64);
};

/// Kinds of obstacles for a body of the arm. An obstacle that contains the body when the motion begins may be left but
/// not entered further; others may not be entered. Stationary obstacles give tighter bounds between two moments than
/// those that may move fast.
enum ObstacleRow : int { kStanding, kMoving, kEnteredStanding, kEnteredMoving };
inline constexpr int kObstacleRows = 4;  ///< how many kinds there are

/// Smallest gaps of each link to obstacles of each kind, m; infinity where there is none or it is not wanted.
using ObstacleGaps =
    Eigen::Array<double, kObstacleRows, Eigen::Dynamic, Eigen::ColMajor, kObstacleRows, kMaxJoints + 1>;

/// Gaps to the obstacles from find(), t (s) after the motion's beginning. Call set_position before.
ObstacleGaps obstacle_gaps(const ObstacleSweep& sweep, const Kinematics& arm, double t, const LinkMask& wanted);

}  // namespace steadyhand
