#include "steadyhand/arms/ros2/ros2_bridge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <utility>

#include "steadyhand/arms/ros2/stamps.hpp"
#include "steadyhand/core/text.hpp"

namespace steadyhand {

namespace {

constexpr double kUnit = 1e-3;         ///< by which the norm of a quaternion may be off
constexpr std::int32_t kCylinder = 3;  ///< visualization_msgs/Marker
constexpr double kSurface = 0.001;     ///< m, as thick as the liquid's surface is drawn
constexpr Time kSilence = std::chrono::milliseconds(250);
constexpr Time kUnheeded = std::chrono::seconds(1);  ///< after which it is said that poses need a pause

geometry_msgs_msg_dds__Pose_ message_of(const Pose& pose) {
  return {{pose.p.x(), pose.p.y(), pose.p.z()}, {pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()}};
}

}  // namespace

std::string topic_of(const std::string& topic, const std::vector<std::string>& tools, int tool) {
  if (tool == 0) return topic;
  std::string name = tools[static_cast<std::size_t>(tool)];
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  if (std::isdigit(static_cast<unsigned char>(name.front())) != 0) name.insert(0, "_");
  const std::size_t last = topic.rfind('/') + 1;  // 0 without any
  return topic.substr(0, last) + name + "/" + topic.substr(last);
}

Result<std::unique_ptr<Ros2Bridge>> Ros2Bridge::open(const RobotModel& model, const GlassSettings& glass,
                                                     const Ros2Settings& settings, const Clock& clock, OnHand on_hand,
                                                     Ros2Node::OnFailure failed) {
  std::unique_ptr<Ros2Bridge> bridge(new Ros2Bridge(model, glass, settings, clock, std::move(on_hand)));
  if (Status joined = bridge->join(settings, std::move(failed)); !joined) return joined.error();
  return bridge;
}

Ros2Bridge::Ros2Bridge(const RobotModel& model, const GlassSettings& glass, const Ros2Settings& settings,
                       const Clock& clock, OnHand on_hand)
    : glass_(glass),
      X_base_root_{model.mount.translation(), Quaternion(model.mount.linear())},
      clock_(&clock),
      on_hand_(std::move(on_hand)),
      frame_(settings.prefix + model.link_names.front()),
      names_{"glass", "liquid"} {
  header_.frame_id = frame_.data();
  for (const Tool& tool : model.tools) tools_.push_back(tool.name);
  if (settings.hand.empty()) return;
  for (int t = 0; t < std::ssize(tools_); ++t) sides_[t].hand = topic_of(settings.hand, tools_, t);
}

Status Ros2Bridge::join(const Ros2Settings& settings, Ros2Node::OnFailure failed) {
  const Result<int> domain = ros2_domain(settings.domain);
  if (!domain) return domain.error();
  auto node = Ros2Node::open(*domain, false, std::move(failed));
  if (!node) return node.error();
  for (int t = 0; t < std::ssize(tools_); ++t) {
    if (Status s = join_side(**node, t); !s) return s;
  }
  node_ = std::move(*node);
  return Done{};
}

Status Ros2Bridge::join_side(Ros2Node& node, int tool) {
  Side& side = sides_[tool];
  auto target = node.publish<PoseStampedMessage>(topic_of("/steadyhand/target", tools_, tool));
  if (!target) return target.error();
  auto path = node.publish<PathMessage>(topic_of("/steadyhand/path", tools_, tool));
  if (!path) return path.error();
  auto liquid = node.publish<MarkerArrayMessage>(topic_of("/steadyhand/liquid", tools_, tool));
  if (!liquid) return liquid.error();
  side.target = *target;
  side.path = *path;
  side.liquid = *liquid;
  if (side.hand.empty()) return Done{};
  return node.listen<PoseStampedMessage>(
      side.hand, [this, tool](const PoseStampedMessage& message, Ros2PublisherId) { take_pose(tool, message); });
}

Status Ros2Bridge::listen_to_scene(OnScene on_scene) {
  const auto listen = [&]<typename Message>(const char* topic, const Message*) {
    return node_->listen<Message>(topic,
                                  [on_scene](const Message& message, Ros2PublisherId) { on_scene(read(message)); });
  };
  if (Status s = listen("/planning_scene", static_cast<PlanningSceneMessage*>(nullptr)); !s) return s;
  if (Status s = listen("/collision_object", static_cast<CollisionObjectMessage*>(nullptr)); !s) return s;
  return listen("/attached_collision_object", static_cast<AttachedObjectMessage*>(nullptr));
}

void Ros2Bridge::take_pose(int tool, const PoseStampedMessage& message) {
  Side& side = sides_[tool];
  const auto& [position, orientation] = message.pose;
  OperatorSample sample;
  sample.tool = tool;
  sample.X_operator_hand.p = {position.x, position.y, position.z};
  sample.X_operator_hand.q = Quaternion(orientation.w, orientation.x, orientation.y, orientation.z);
  const double norm = sample.X_operator_hand.q.norm();
  const bool ours = message.header.frame_id[0] == '\0' || frame_ == message.header.frame_id;
  if (!ours) {
    const std::string_view theirs = message.header.frame_id;
    return refuse(side, Refusal::kFrame,
                  fmt::format("their frame is '{}'; it must be '{}', or empty",
                              is_name(theirs) ? theirs.substr(0, 100) : "?", frame_));
  }
  if (!sample.X_operator_hand.p.allFinite())
    return refuse(side, Refusal::kPosition, "a position is not finite; it must be, in m");
  if (!(std::abs(norm - 1.0) < kUnit)) {
    return refuse(side, Refusal::kQuaternion,
                  fmt::format("a quaternion has the length {:.4g}; it must be 1 (x, y, z, w)", norm));
  }
  sample.X_operator_hand.q.normalize();
  sample.X_operator_hand = X_base_root_ * sample.X_operator_hand;
  const Time now = clock_->now(), theirs = time_of(message.header.stamp);
  if (theirs < side.theirs) side.offset.reset();  // their clock was set back, or another sends
  side.theirs = theirs;
  sample.stamp = {theirs > Time(0) ? std::min(side.offset.update(theirs, now, true), now) : now, now};
  side.received = now;
  sample.clutch = side.closed.exchange(true);  // the first one finds it open: only a fresh grip counts
  on_hand_(sample);
}

void Ros2Bridge::refuse(const Side& side, Refusal refusal, const std::string& why) {
  if (refusal != Refusal::kNoPause) ++ignored_;
  const std::lock_guard lock(mutex_);
  if (!told_.insert({&side, refusal}).second) return;
  notices_.push_back(fmt::format("poses on {} do not move the arm: {}", side.hand, why));
}

std::vector<std::string> Ros2Bridge::take_notices() {
  const std::lock_guard lock(mutex_);
  return std::exchange(notices_, {});
}

/// A grip counts once: one that began before the arm was ready, or before it stopped, moves nothing.
void Ros2Bridge::watch_for_pause(Side& side, SupervisionState state, bool heeded) {
  const Time now = clock_->now();
  if (!side.closed || !heeded || state != SupervisionState::kReady) {
    side.unheeded_since.reset();
  } else if (!side.unheeded_since) {
    side.unheeded_since = now;
  } else if (now - *side.unheeded_since > kUnheeded) {
    refuse(side, Refusal::kNoPause,
           fmt::format("they began before the arm was ready; stop sending for {} s, then send again",
                       to_seconds(kSilence)));
  }
}

void Ros2Bridge::poll(Time now) {
  for (int t = 0; t < std::ssize(tools_); ++t) {
    Side& side = sides_[t];
    if (!side.closed || now - side.received.load() < kSilence || !side.closed.exchange(false)) continue;
    OperatorSample open;
    open.stamp = {now, now};
    open.tracked = false;
    open.tool = t;
    on_hand_(open);
  }
}

void Ros2Bridge::publish(const SessionSnapshot& snapshot, bool heeded) {
  header_.stamp = stamp_of<builtin_interfaces_msg_dds__Time_>(
      std::chrono::system_clock::now().time_since_epoch());  // as nodes of ROS stamp what they send
  for (int t = 0; t < std::min<int>(snapshot.tool_count, static_cast<int>(tools_.size())); ++t) {
    const ToolSnapshot& tool = snapshot.tools[t];
    watch_for_pause(sides_[t], tool.state, heeded);
    show_target(sides_[t], tool);
    show_path(sides_[t], tool);
    show_liquid(sides_[t], tool);
  }
}

geometry_msgs_msg_dds__Pose_ Ros2Bridge::in_root(const Pose& pose) const {
  return message_of(X_base_root_.inverse() * pose);
}

void Ros2Bridge::show_target(Side& side, const ToolSnapshot& tool) {
  (void)side.target.send({header_, in_root(tool.target.X_base_tool)});
}

void Ros2Bridge::show_path(Side& side, const ToolSnapshot& tool) {
  std::vector<PoseStampedMessage> poses;
  for (int k = 0; k < tool.path_nodes; ++k) poses.push_back({header_, in_root(tool.path[k])});
  PathMessage path{};
  path.header = header_;
  path.poses = sequence_of<decltype(path.poses)>(poses);
  (void)side.path.send(path);
}

/// The glass, and in it the liquid's surface, red once it has gone over the rim.
void Ros2Bridge::show_liquid(Side& side, const ToolSnapshot& tool) {
  std::array<MarkerMessage, 2> markers{};
  for (int i = 0; i < 2; ++i) {
    MarkerMessage& marker = markers[i];
    marker.header = header_;
    marker.ns = names_[i].data();
    marker.type = kCylinder;
    marker.scale = {2.0 * glass_.radius, 2.0 * glass_.radius, i == 0 ? glass_.height : kSurface};
    marker.pose = in_root(tool.X_base_tool);
    marker.texture_resource = marker.text = marker.mesh_resource = marker.mesh_file.filename = nothing_.data();
    marker.texture.header = header_;
    marker.texture.format = nothing_.data();
  }
  markers[0].color = {0.8f, 0.9f, 1.0f, 0.25f};
  const Pose X_tool_surface{{0.0, 0.0, glass_.fill - 0.5 * glass_.height},
                            Quaternion(Eigen::AngleAxisd(tool.liquid.tilt_x, Vector3::UnitX()) *
                                       Eigen::AngleAxisd(tool.liquid.tilt_y, Vector3::UnitY()))};
  markers[1].pose = in_root(tool.X_base_tool * X_tool_surface);
  markers[1].color = tool.liquid.spilled ? std_msgs_msg_dds__ColorRGBA_{0.9f, 0.2f, 0.1f, 0.9f}
                                         : std_msgs_msg_dds__ColorRGBA_{0.2f, 0.5f, 0.9f, 0.9f};
  MarkerArrayMessage array{};
  array.markers = sequence_of<decltype(array.markers)>(markers);
  (void)side.liquid.send(array);
}

}  // namespace steadyhand
