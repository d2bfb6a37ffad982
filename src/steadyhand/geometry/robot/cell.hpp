#pragma once

#include <string>
#include <vector>

#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {

/// A solid object near an arm.
struct CellObject {
  std::string name;                              ///< for people
  Shape shape;                                   ///< without its margin
  Eigen::Isometry3d origin;                      ///< pose of the shape's frame, in the base, or the root
  bool in_root = false;                          ///< origin and velocity are in the frame of the URDF's root
  Vector3 velocity = Vector3::Zero();            ///< m/s, in the same frame
  double margin = 0.01;                          ///< m, kept around it
  std::vector<std::string> may_be_touched_by{};  ///< bodies or links of the arm, or other objects if carried
  bool holds_only_tool = false;                  ///< all but the bodies on the tools' links may touch it
  /// The tool carries it: origin is in the tool's frame, and it moves with the arm as a part of it, without its own
  /// velocity or margin. Bodies on the tool's link may touch it.
  bool attached = false;
  std::string color{};  ///< "#rrggbb" on the page; empty: the page's own; "none": not drawn
  int tool = 0;         ///< index of the tool that carries it
};

/// Obstacles of an arm, by name.
struct Cell {
  std::string name;                 ///< for people
  std::vector<CellObject> objects;  ///< with different names
};

/// The cell with all its objects in the base, where the arm's mount has its root.
Cell in_base(Cell cell, const RobotModel& model);

/// The cell `t` s later: moving objects have moved, and stop at Obstacles::kFarthest.
Cell cell_after(Cell cell, double t);

/// Fails on cells that cannot be, and where what the tool carries overlaps (by more than 2 mm) a body of the arm that
/// must not touch it, which no motion might bring apart. Call set_position before.
Status check_carried(const Cell& cell, const Kinematics& arm);

/// The cell with this object attached to a tool (its index), or released, at its present pose. Fails if the cell has no
/// object of this name, if it is carried already, or is not, on half-spaces, and as check_carried. Call set_position
/// before.
Result<Cell> attach(Cell cell, const std::string& name, const Kinematics& arm, int tool = 0);
/// The same, back.
Result<Cell> detach(Cell cell, const std::string& name, const Kinematics& arm);

/// The cell without this object; others no longer name it among what may touch them. Fails if there is none.
Result<Cell> without(Cell cell, const std::string& name);

/// The objects as a planner takes them, in the same order, with their margins. Fails on more than there may be, on
/// sizes and numbers that cannot be, on two of one name, and on bodies, links or objects that there are not, with the
/// reason.
Result<Obstacles> obstacles_of(const Cell& cell, const RobotModel& model);

}  // namespace steadyhand
