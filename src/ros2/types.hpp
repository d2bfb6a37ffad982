#pragma once

#include <dds/dds.h>
#include <messages.h>  // made from messages.idl by idlc

namespace steadyhand {

using JointTrajectoryMessage = trajectory_msgs_msg_dds__JointTrajectory_;
using JointTrajectoryPointMessage = trajectory_msgs_msg_dds__JointTrajectoryPoint_;
using JointStateMessage = sensor_msgs_msg_dds__JointState_;
using PoseStampedMessage = geometry_msgs_msg_dds__PoseStamped_;
using PathMessage = nav_msgs_msg_dds__Path_;
using MarkerMessage = visualization_msgs_msg_dds__Marker_;
using MarkerArrayMessage = visualization_msgs_msg_dds__MarkerArray_;

/// What DDS has to know of a type of message.
inline const dds_topic_descriptor_t& descriptor_of(const JointTrajectoryMessage*) {
  return trajectory_msgs_msg_dds__JointTrajectory__desc;
}
inline const dds_topic_descriptor_t& descriptor_of(const JointStateMessage*) {
  return sensor_msgs_msg_dds__JointState__desc;
}
inline const dds_topic_descriptor_t& descriptor_of(const PoseStampedMessage*) {
  return geometry_msgs_msg_dds__PoseStamped__desc;
}
inline const dds_topic_descriptor_t& descriptor_of(const PathMessage*) { return nav_msgs_msg_dds__Path__desc; }
inline const dds_topic_descriptor_t& descriptor_of(const MarkerArrayMessage*) {
  return visualization_msgs_msg_dds__MarkerArray__desc;
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
