#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/arms/driver/offset_filter.hpp"
#include "steadyhand/arms/driver/ros2_settings.hpp"
#include "steadyhand/arms/ros2/moveit_scene_messages.hpp"
#include "steadyhand/arms/ros2/node.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/session/live/live_taps.hpp"

namespace steadyhand {

/// Shows a session to ROS 2, except the arm itself, and takes poses that control the arm. Publishes for RViz the target
/// (geometry_msgs/PoseStamped), the planned path (nav_msgs/Path), and the glass and its liquid
/// (visualization_msgs/MarkerArray), in the frame of the arm's base. Takes poses (geometry_msgs/PoseStamped) as the
/// operator's hand: while they come, the clutch is engaged, so their changes move the arm. A robot's second tool has
/// its own topics, whose last part follows the tool's name; see topic_of().
class Ros2Bridge {
 public:
  using OnHand = std::function<void(const OperatorSample&)>;
  using OnScene = std::function<void(Result<SceneChange>)>;

  /// @param on_hand called on a thread of DDS and in poll() @param failed when it threw there. Model and clock must
  /// outlive it.
  static Result<std::unique_ptr<Ros2Bridge>> open(const RobotModel& model, const GlassSettings& glass,
                                                  const Ros2Settings& settings, const Clock& clock, OnHand on_hand,
                                                  Ros2Node::OnFailure failed);

  /// Takes objects from MoveIt's topics: /planning_scene, /collision_object and /attached_collision_object.
  /// @param on_scene called on a thread of DDS, one call after the other, with what a message says, or why it is none
  Status listen_to_scene(OnScene on_scene);
  /// @param heeded poses may control the arm: no client on the page does
  void publish(const SessionSnapshot& snapshot, bool heeded = true);
  /// Releases the clutch when poses stop coming. Call every few milliseconds.
  void poll(Time now);
  /// Poses whose frame is not the base's, or that are no poses.
  std::uint64_t ignored() const { return ignored_; }
  /// For people: why poses do not move the arm. Each reason once. Any thread.
  std::vector<std::string> take_notices();

 private:
  Ros2Bridge(const RobotModel& model, const GlassSettings& glass, const Ros2Settings& settings, const Clock& clock,
             OnHand on_hand);
  Status join(const Ros2Settings& settings, Ros2Node::OnFailure failed);
  /// Topics of a tool, and the poses of its hand.
  struct Side {
    std::string hand;  ///< its topic; empty: none
    Ros2Publisher<PoseStampedMessage> target;
    Ros2Publisher<PathMessage> path;
    Ros2Publisher<MarkerArrayMessage> liquid;
    OffsetFilter offset;  ///< thread that listens; the next too
    Time theirs{0};       ///< stamp of the newest pose
    std::atomic<Time> received{Time::min()};
    std::atomic<bool> closed{false};
    std::optional<Time> unheeded_since;  ///< poses come, and the arm could follow them, but does not
  };
  /// Why poses are not taken.
  enum class Refusal { kFrame, kPosition, kQuaternion, kNoPause };
  Status join_side(Ros2Node& node, int tool);
  void refuse(const Side& side, Refusal refusal, const std::string& why);
  void watch_for_pause(Side& side, SupervisionState state, bool heeded);
  void take_pose(int tool, const PoseStampedMessage& message);
  void show_target(Side& side, const ToolSnapshot& tool);
  void show_path(Side& side, const ToolSnapshot& tool);
  void show_liquid(Side& side, const ToolSnapshot& tool);
  /// As ROS has it: in the frame of the URDF's root.
  geometry_msgs_msg_dds__Pose_ in_root(const Pose& pose) const;

  GlassSettings glass_;
  Pose X_base_root_;
  const Clock* clock_;
  OnHand on_hand_;
  std::string frame_, nothing_;
  std::vector<std::string> names_;  ///< of markers
  std_msgs_msg_dds__Header_ header_{};
  std::vector<std::string> tools_;  ///< names
  PerTool<Side> sides_;
  std::atomic<std::uint64_t> ignored_{0};
  std::mutex mutex_;                                ///< guards the next two
  std::set<std::pair<const Side*, Refusal>> told_;  ///< reasons that were reported
  std::vector<std::string> notices_;
  std::unique_ptr<Ros2Node> node_;  ///< last: goes first
};

/// Topic of a tool: of the first one `topic`, of others `topic` with the tool's name before its last part, in which
/// letters that no topic may have become "_": /steadyhand/target and /steadyhand/right/target.
std::string topic_of(const std::string& topic, const std::vector<std::string>& tools, int tool);

}  // namespace steadyhand
