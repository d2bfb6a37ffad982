#pragma once

#include <dds/dds.h>
#include <messages.h>  // made from messages.idl by idlc

#include <string_view>

namespace steadyhand {

using JointTrajectoryMessage = trajectory_msgs_msg_dds__JointTrajectory_;
using JointTrajectoryPointMessage = trajectory_msgs_msg_dds__JointTrajectoryPoint_;
using ControllerStateMessage = control_msgs_msg_dds__JointTrajectoryControllerState_;
using Float64Message = std_msgs_msg_dds__Float64_;
using JointStateMessage = sensor_msgs_msg_dds__JointState_;
using PoseStampedMessage = geometry_msgs_msg_dds__PoseStamped_;
using PathMessage = nav_msgs_msg_dds__Path_;
using MarkerMessage = visualization_msgs_msg_dds__Marker_;
using MarkerArrayMessage = visualization_msgs_msg_dds__MarkerArray_;
using CollisionObjectMessage = moveit_msgs_msg_dds__CollisionObject_;
using AttachedObjectMessage = moveit_msgs_msg_dds__AttachedCollisionObject_;
using PlanningSceneMessage = moveit_msgs_msg_dds__PlanningScene_;

/// What DDS has to know of a type of message, and the hash of its definition by which nodes of ROS (from Iron on) know
/// it: REP 2016. None where distributions differ.
struct Ros2Type {
  const dds_topic_descriptor_t* descriptor;
  std::string_view hash = {};
};

inline Ros2Type type_of(const JointTrajectoryMessage*) {
  return {&trajectory_msgs_msg_dds__JointTrajectory__desc,
          "179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e"};
}
inline Ros2Type type_of(const ControllerStateMessage*) {
  return {&control_msgs_msg_dds__JointTrajectoryControllerState__desc};
}
inline Ros2Type type_of(const Float64Message*) {
  return {&std_msgs_msg_dds__Float64__desc, "705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a"};
}
inline Ros2Type type_of(const JointStateMessage*) {
  return {&sensor_msgs_msg_dds__JointState__desc, "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"};
}
inline Ros2Type type_of(const PoseStampedMessage*) {
  return {&geometry_msgs_msg_dds__PoseStamped__desc,
          "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"};
}
inline Ros2Type type_of(const PathMessage*) {
  return {&nav_msgs_msg_dds__Path__desc, "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b"};
}
inline Ros2Type type_of(const MarkerArrayMessage*) {
  return {&visualization_msgs_msg_dds__MarkerArray__desc,
          "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"};
}

inline Ros2Type type_of(const CollisionObjectMessage*) { return {&moveit_msgs_msg_dds__CollisionObject__desc}; }
inline Ros2Type type_of(const AttachedObjectMessage*) { return {&moveit_msgs_msg_dds__AttachedCollisionObject__desc}; }
inline Ros2Type type_of(const PlanningSceneMessage*) { return {&moveit_msgs_msg_dds__PlanningScene__desc}; }

/// A DDS sequence over the elements of something contiguous that outlives it.
template <typename Sequence, typename Container>
Sequence sequence_of(Container& elements) {
  Sequence sequence{};
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(elements.size());
  sequence._buffer = elements.data();
  return sequence;
}

}  // namespace steadyhand
