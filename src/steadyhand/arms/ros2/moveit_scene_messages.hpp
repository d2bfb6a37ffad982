#pragma once

#include <map>
#include <string>
#include <vector>

#include "steadyhand/arms/ros2/types.hpp"
#include "steadyhand/geometry/robot/cell.hpp"

namespace steadyhand {

/// One object in a message of MoveIt's: moveit_msgs/CollisionObject or AttachedCollisionObject.
struct SceneObject {
  /// The numbers are CollisionObject's.
  enum class Operation { kAdd = 0, kRemove = 1, kAppend = 2, kMove = 3 };
  Operation operation = Operation::kAdd;
  std::string id;     ///< empty, to be removed or detached: all of them
  std::string frame;  ///< of `pose`
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::vector<CellObject> parts;         ///< a shape each, their origins in `pose`
  bool attached = false;                 ///< the tool takes it, or, if removed, releases it
  std::string link;                      ///< the link that carries it
  std::vector<std::string> touch_links;  ///< links of the arm that may touch it
  std::string color{};                   ///< "#rrggbb", or empty
};

/// The changes by one message.
struct SceneChange {
  bool replaces = false;  ///< removes all objects of earlier messages
  std::vector<SceneObject> objects;
};

/// Boxes, spheres and cylinders, and each cone as the cylinder around it. Fails, with the object's id, on other
/// shapes (meshes, planes, prisms, voxels: the arm would not avoid them), on invalid sizes, and on poses that are not
/// finite or have no unit quaternion (all zero counts as none given).
Result<SceneChange> read(const CollisionObjectMessage& message);
Result<SceneChange> read(const AttachedObjectMessage& message);
Result<SceneChange> read(const PlanningSceneMessage& message);

/// Updates a cell by MoveIt's messages. The parts of an object of several shapes are called ID, ID/2, ID/3...
/// Objects from other sources stay in the cell, unless a message names them.
class SceneKeeper {
 public:
  /// @param prefix of the names of frames and links on the ROS side
  SceneKeeper(const RobotModel& model, std::string prefix) : model_(&model), prefix_(std::move(prefix)) {}

  /// The cell with the change in it. Fails, and changes nothing, on frames that are neither the root's nor the tool's
  /// (link or frame), on links that carry nothing here, and on objects that there are not.
  /// @param arm after set_position
  Result<Cell> apply(const SceneChange& change, Cell cell, const Kinematics& arm);

 private:
  Result<Cell> apply(const SceneObject& object, Cell cell, const Kinematics& arm);
  Result<Cell> remove(const SceneObject& object, Cell cell);
  Result<Cell> move(const SceneObject& object, const Eigen::Isometry3d& pose, Cell cell);
  void add(const SceneObject& object, const Eigen::Isometry3d& pose, Cell& cell);
  Result<Cell> take_up(const SceneObject& object, Cell cell, const Kinematics& arm) const;
  Result<Eigen::Isometry3d> in_base(const std::string& frame, const Kinematics& arm) const;
  std::string link_name(const std::string& name) const;

  const RobotModel* model_;
  std::string prefix_;
  std::map<std::string, std::vector<Eigen::Isometry3d>> parts_;  ///< by id: origins in the object's pose
};

}  // namespace steadyhand
