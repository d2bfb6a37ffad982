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
using GoalStatusArrayMessage = action_msgs_msg_dds__GoalStatusArray_;
using GripperFeedbackMessage = control_msgs_action_dds__GripperCommand_FeedbackMessage_;
/// Messages of an action's services, as most middlewares of ROS send them ...
using SendGoalRequest = control_msgs_action_dds__GripperCommand_SendGoal_Request_;
using SendGoalResponse = control_msgs_action_dds__GripperCommand_SendGoal_Response_;
using GetResultRequest = control_msgs_action_dds__GripperCommand_GetResult_Request_;
using GetResultResponse = control_msgs_action_dds__GripperCommand_GetResult_Response_;
using CancelGoalRequest = action_msgs_srv_dds__CancelGoal_Request_;
/// ... and as Cyclone DDS's does, with the client's id first.
using NumberedSendGoalRequest = numbered_dds__SendGoal_Request_;
using NumberedSendGoalResponse = numbered_dds__SendGoal_Response_;
using NumberedGetResultRequest = numbered_dds__GetResult_Request_;
using NumberedGetResultResponse = numbered_dds__GetResult_Response_;
using NumberedCancelGoalRequest = numbered_dds__CancelGoal_Request_;
/// The same of ParallelGripperCommand; requests to cancel are those of any action.
using ParallelFeedbackMessage = control_msgs_action_dds__ParallelGripperCommand_FeedbackMessage_;
using ParallelSendGoalRequest = control_msgs_action_dds__ParallelGripperCommand_SendGoal_Request_;
using ParallelSendGoalResponse = control_msgs_action_dds__ParallelGripperCommand_SendGoal_Response_;
using ParallelGetResultRequest = control_msgs_action_dds__ParallelGripperCommand_GetResult_Request_;
using ParallelGetResultResponse = control_msgs_action_dds__ParallelGripperCommand_GetResult_Response_;
using NumberedParallelSendGoalRequest = numbered_dds__ParallelSendGoal_Request_;
using NumberedParallelSendGoalResponse = numbered_dds__ParallelSendGoal_Response_;
using NumberedParallelGetResultRequest = numbered_dds__ParallelGetResult_Request_;
using NumberedParallelGetResultResponse = numbered_dds__ParallelGetResult_Response_;

/// A message type's descriptor for DDS, and the hash of its definition by which nodes of ROS (from Iron on) identify
/// it: REP 2016. None where distributions differ.
struct Ros2Type {
  const dds_topic_descriptor_t* descriptor;
  std::string_view hash = {};
  const char* name = nullptr;  ///< on DDS, where it is not the descriptor's own
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

inline Ros2Type type_of(const GoalStatusArrayMessage*) {
  return {&action_msgs_msg_dds__GoalStatusArray__desc,
          "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e"};
}
inline Ros2Type type_of(const GripperFeedbackMessage*) {
  return {&control_msgs_action_dds__GripperCommand_FeedbackMessage__desc,
          "392ff03fcd872f9dc2405cbeb2897fcf011ad9998458b6aa85c603b8a49e431d"};
}
inline Ros2Type type_of(const SendGoalRequest*) {
  return {&control_msgs_action_dds__GripperCommand_SendGoal_Request__desc,
          "1b869b7b4042272dc0f8ed65468c4e57c9e532ea5e53ce74fda0767eefbfa983"};
}
inline Ros2Type type_of(const SendGoalResponse*) {
  return {&control_msgs_action_dds__GripperCommand_SendGoal_Response__desc,
          "0c8dda5e9d39ab5e3162b66e79b292a4258659ddfcf8722d39463f718b6c59bc"};
}
inline Ros2Type type_of(const GetResultRequest*) {
  return {&control_msgs_action_dds__GripperCommand_GetResult_Request__desc,
          "1a3308da3acbc62cd8a3c823de80ba9e5f9b6bb6f6056d1ad6b29f5f285f97ae"};
}
inline Ros2Type type_of(const GetResultResponse*) {
  return {&control_msgs_action_dds__GripperCommand_GetResult_Response__desc,
          "32ed5e1b5906767a3e9914dca4c4aed22529918f6c2360e6fb382363d4df4b45"};
}
inline Ros2Type type_of(const CancelGoalRequest*) {
  return {&action_msgs_srv_dds__CancelGoal_Request__desc,
          "3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af"};
}
inline Ros2Type type_of(const ParallelFeedbackMessage*) {
  return {&control_msgs_action_dds__ParallelGripperCommand_FeedbackMessage__desc,
          "c61f4cf99d06c5a3e24bed17c2910bdf66a30d89461e2ac7b5fd538a34b022cc"};
}
inline Ros2Type type_of(const ParallelSendGoalRequest*) {
  return {&control_msgs_action_dds__ParallelGripperCommand_SendGoal_Request__desc,
          "dc8e5d95c0e15af6f03ff237eb8cfdaac14cc2b09f51b363311e98ec0a8487a0"};
}
inline Ros2Type type_of(const ParallelSendGoalResponse*) {
  return {&control_msgs_action_dds__ParallelGripperCommand_SendGoal_Response__desc,
          "613e4f060bff03b152eeaba1f8c6baa9d0309527b28b08bc9aae28ece7ef8b47"};
}
inline Ros2Type type_of(const ParallelGetResultRequest*) {
  return {&control_msgs_action_dds__ParallelGripperCommand_GetResult_Request__desc,
          "cea82415cadc3288fdfa8aaba509e9939732aaecac6edf9cb954e5a7161646ec"};
}
inline Ros2Type type_of(const ParallelGetResultResponse*) {
  return {&control_msgs_action_dds__ParallelGripperCommand_GetResult_Response__desc,
          "c973b1bb9b454de1c3f38a2af9d45bc1930b809f746d6d6ec91bb3c783cb09eb"};
}
/// The numbered one under the other's name.
inline Ros2Type numbered(const dds_topic_descriptor_t& numbered, const Ros2Type& plain) {
  return {&numbered, plain.hash, plain.descriptor->m_typename};
}
inline Ros2Type type_of(const NumberedSendGoalRequest*) {
  return numbered(numbered_dds__SendGoal_Request__desc, type_of(static_cast<SendGoalRequest*>(nullptr)));
}
inline Ros2Type type_of(const NumberedSendGoalResponse*) {
  return numbered(numbered_dds__SendGoal_Response__desc, type_of(static_cast<SendGoalResponse*>(nullptr)));
}
inline Ros2Type type_of(const NumberedGetResultRequest*) {
  return numbered(numbered_dds__GetResult_Request__desc, type_of(static_cast<GetResultRequest*>(nullptr)));
}
inline Ros2Type type_of(const NumberedGetResultResponse*) {
  return numbered(numbered_dds__GetResult_Response__desc, type_of(static_cast<GetResultResponse*>(nullptr)));
}
inline Ros2Type type_of(const NumberedCancelGoalRequest*) {
  return numbered(numbered_dds__CancelGoal_Request__desc, type_of(static_cast<CancelGoalRequest*>(nullptr)));
}
inline Ros2Type type_of(const NumberedParallelSendGoalRequest*) {
  return numbered(numbered_dds__ParallelSendGoal_Request__desc,
                  type_of(static_cast<ParallelSendGoalRequest*>(nullptr)));
}
inline Ros2Type type_of(const NumberedParallelSendGoalResponse*) {
  return numbered(numbered_dds__ParallelSendGoal_Response__desc,
                  type_of(static_cast<ParallelSendGoalResponse*>(nullptr)));
}
inline Ros2Type type_of(const NumberedParallelGetResultRequest*) {
  return numbered(numbered_dds__ParallelGetResult_Request__desc,
                  type_of(static_cast<ParallelGetResultRequest*>(nullptr)));
}
inline Ros2Type type_of(const NumberedParallelGetResultResponse*) {
  return numbered(numbered_dds__ParallelGetResult_Response__desc,
                  type_of(static_cast<ParallelGetResultResponse*>(nullptr)));
}

/// A DDS sequence over the elements of something contiguous that outlives it.
template <typename Sequence, typename Container>
Sequence sequence_of(Container& elements) {
  Sequence sequence{};
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(elements.size());
  sequence._buffer = elements.data();
  return sequence;
}

}  // namespace steadyhand
