// What a ROS 2 machine sees of a session, and how its poses control it.
#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ros2/ros2_bridge.hpp"
#include "steadyhand/arms/ros2/stamps.hpp"
#include "support/manual_clock.hpp"
#include "support/ros2/lockstep.hpp"

namespace steadyhand {
namespace {

using namespace std::chrono_literals;

class Ros2BridgeTest : public testing::Test {
 protected:
  Ros2BridgeTest() : random(2), model(random_arm(6, random, false)) {
    model.mount = Eigen::Translation3d(0.1, 0.2, 1.5) * Eigen::AngleAxisd(M_PI, Vector3::UnitX());
    settings.domain = isolated_ros2_domain();
    settings.prefix = "left_";
    settings.hand = "/hand" + std::to_string(getpid());
    frame = "left_" + model.link_names.front();
    auto opened = Ros2Bridge::open(
        model, glass, settings, clock,
        [this](const OperatorSample& sample) {
          if (throws) throw std::runtime_error("no memory");
          samples.push_back(sample);
        },
        [this](const char* what) { failures.emplace_back(what); });
    auto joined = Ros2Node::open(settings.domain);
    EXPECT_TRUE(opened && joined);
    bridge = std::move(*opened);
    peer = std::move(*joined);
  }
  /// Poses as a VR bridge sends them.
  void send(Ros2Publisher<PoseStampedMessage>& publisher, const Pose& pose, std::string in, Time stamp = Time(0)) {
    const PoseStampedMessage message{
        {stamp_of<builtin_interfaces_msg_dds__Time_>(stamp), in.data()},
        {{pose.p.x(), pose.p.y(), pose.p.z()}, {pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()}}};
    EXPECT_TRUE(publisher.send(message));
  }

  std::mt19937 random;
  RobotModel model;
  ManualClock clock;
  GlassSettings glass;
  Ros2Settings settings;
  std::string frame;
  std::vector<OperatorSample> samples;
  std::vector<std::string> failures;
  bool throws = false;
  std::unique_ptr<Ros2Node> peer;
  std::unique_ptr<Ros2Bridge> bridge;
};

TEST_F(Ros2BridgeTest, ShowsTargetPathAndLiquid) {
  SessionSnapshot snapshot;
  ToolSnapshot& tool = snapshot.tools[0];
  tool.target.X_base_tool = {{0.1, 0.2, 0.3}, Quaternion(Eigen::AngleAxisd(0.5, Vector3::UnitZ()))};
  tool.path_nodes = 3;
  for (int k = 0; k < 3; ++k) tool.path[k].p = {1.0 * k, 0.0, 0.5};
  tool.X_base_tool.p = {0.4, 0.5, 0.6};
  tool.liquid.tilt_x = 0.1;
  Pose target;
  std::vector<double> path;
  std::vector<Pose> markers;
  std::vector<std::string> frames;
  const auto pose_of = [](const auto& pose) {
    return Pose{{pose.position.x, pose.position.y, pose.position.z},
                Quaternion(pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z)};
  };
  ASSERT_TRUE(peer->listen<PoseStampedMessage>("/steadyhand/target", [&](const auto& message, auto) {
    target = pose_of(message.pose);
    frames.emplace_back(message.header.frame_id);
  }));
  ASSERT_TRUE(peer->listen<PathMessage>("/steadyhand/path", [&](const auto& message, auto) {
    for (std::uint32_t i = 0; i < message.poses._length; ++i) {
      path.push_back(message.poses._buffer[i].pose.position.x);
    }
    frames.emplace_back(message.header.frame_id);
  }));
  ASSERT_TRUE(peer->listen<MarkerArrayMessage>("/steadyhand/liquid", [&](const auto& message, auto) {
    for (std::uint32_t i = 0; i < message.markers._length; ++i) {
      markers.push_back(pose_of(message.markers._buffer[i].pose));
      frames.emplace_back(message.markers._buffer[i].header.frame_id);
    }
  }));
  bridge->publish(snapshot);
  peer.reset();  // whose callbacks use what is here
  const Pose X_base_root{model.mount.translation(), Quaternion(model.mount.linear())};
  EXPECT_LT((X_base_root * target.p - tool.target.X_base_tool.p).norm(), 1e-12);
  EXPECT_LT((X_base_root * target).q.angularDistance(tool.target.X_base_tool.q), 1e-7);
  ASSERT_EQ(path.size(), 3u);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(path[k], k - 0.1, 1e-12);
  ASSERT_EQ(markers.size(), 2u);
  EXPECT_LT((X_base_root * markers[0].p - tool.X_base_tool.p).norm(), 1e-12);
  EXPECT_NEAR(markers[1].q.angularDistance(markers[0].q), 0.1, 1e-9);
  EXPECT_EQ(frames, std::vector<std::string>(4, frame));
}

TEST(Ros2Topics, HaveTheNamesOfFurtherTools) {
  const std::vector<std::string> names{"left", "right"};
  EXPECT_EQ(topic_of("/steadyhand/target", names, 0), "/steadyhand/target");
  EXPECT_EQ(topic_of("/steadyhand/target", names, 1), "/steadyhand/right/target");
  EXPECT_EQ(topic_of("/hand", names, 1), "/right/hand");
  EXPECT_EQ(topic_of("hand", names, 1), "right/hand");
  EXPECT_EQ(topic_of("/hand", {"a", "2nd arm"}, 1), "/_2nd_arm/hand") << "no topic may have such a name";
}

/// The second tool has its topics; poses for it move neither the first tool nor its grip.
TEST_F(Ros2BridgeTest, EachToolHasItsTopics) {
  model.tools.push_back(model.tools[0]);
  model.tools[1].name = "right";
  auto opened = Ros2Bridge::open(
      model, glass, settings, clock, [this](const OperatorSample& sample) { samples.push_back(sample); },
      [this](const char* what) { failures.emplace_back(what); });
  ASSERT_TRUE(opened);
  bridge = std::move(*opened);
  SessionSnapshot snapshot;
  snapshot.tool_count = 2;
  snapshot.tools[1].target.X_base_tool.p = {0.4, 0.5, 0.6};
  Vector3 target = Vector3::Zero();
  ASSERT_TRUE(peer->listen<PoseStampedMessage>("/steadyhand/right/target", [&](const auto& message, auto) {
    target = {message.pose.position.x, message.pose.position.y, message.pose.position.z};
  }));
  auto publisher = peer->publish<PoseStampedMessage>("/right" + settings.hand);
  ASSERT_TRUE(publisher);
  bridge->publish(snapshot);
  const Pose X_base_root{model.mount.translation(), Quaternion(model.mount.linear())};
  EXPECT_LT((X_base_root * target - snapshot.tools[1].target.X_base_tool.p).norm(), 1e-12);
  for (int i = 0; i < 3; ++i) send(*publisher, {}, frame);
  ASSERT_EQ(samples.size(), 3u);
  for (const OperatorSample& sample : samples) EXPECT_EQ(sample.tool, 1);
  EXPECT_TRUE(samples.back().clutch);
  clock.advance(0.3);
  bridge->poll(clock.now());
  ASSERT_EQ(samples.size(), 4u) << "the first tool's hand sent nothing";
  EXPECT_EQ(samples.back().tool, 1);
  EXPECT_FALSE(samples.back().clutch);
  peer.reset();  // whose callbacks use what is here
}

TEST_F(Ros2BridgeTest, PosesAreAHandThatGripsWhileTheyCome) {
  auto publisher = peer->publish<PoseStampedMessage>(settings.hand);
  ASSERT_TRUE(publisher);
  const Pose pose{{0.1, 0.2, 0.3}, Quaternion(Eigen::AngleAxisd(0.5, Vector3::UnitX()))};
  for (int i = 0; i < 10; ++i) {
    send(*publisher, pose, i % 2 == 0 ? frame : "");
    clock.advance(0.02);
    bridge->poll(clock.now());
  }
  ASSERT_EQ(samples.size(), 10u);
  const Pose in_base = Pose{model.mount.translation(), Quaternion(model.mount.linear())} * pose;
  EXPECT_FALSE(samples.front().clutch);  // a fresh grip begins open
  for (const OperatorSample& sample : samples) {
    EXPECT_TRUE(sample.tracked);
    EXPECT_TRUE(sample.clutch || &sample == &samples.front());
    EXPECT_LT((sample.X_operator_hand.p - in_base.p).norm(), 1e-12);
    EXPECT_LT(sample.X_operator_hand.q.angularDistance(in_base.q), 1e-7);
  }
  for (int i = 0; i < 50; ++i) {
    clock.advance(0.02);
    bridge->poll(clock.now());
  }
  ASSERT_EQ(samples.size(), 11u);  // once
  EXPECT_FALSE(samples.back().clutch);
  for (const bool closed : {false, true}) {
    send(*publisher, pose, frame);
    EXPECT_EQ(samples.back().clutch, closed);
  }
}

TEST_F(Ros2BridgeTest, WhatIsNoPoseInTheBasesFrameIsIgnored) {
  auto publisher = peer->publish<PoseStampedMessage>(settings.hand);
  ASSERT_TRUE(publisher);
  send(*publisher, {}, "world");
  send(*publisher, {{NAN, 0.0, 0.0}, Quaternion::Identity()}, frame);
  send(*publisher, {Vector3::Zero(), Quaternion(0.0, 0.0, 0.0, 0.0)}, frame);
  send(*publisher, {Vector3::Zero(), Quaternion(INFINITY, 0.0, 0.0, 0.0)}, frame);
  send(*publisher, {}, "world\x1b[2J");
  EXPECT_TRUE(samples.empty());
  EXPECT_EQ(bridge->ignored(), 5u);
  const std::string begin = "poses on " + settings.hand + " do not move the arm: ";
  EXPECT_EQ(bridge->take_notices(),
            (std::vector<std::string>{begin + "their frame is 'world'; it must be '" + frame + "', or empty",
                                      begin + "a position is not finite; it must be, in m",
                                      begin + "a quaternion has the length 0; it must be 1 (x, y, z, w)"}));
  EXPECT_TRUE(bridge->take_notices().empty());
}

TEST_F(Ros2BridgeTest, PosesThatNeverPauseBeforeTheArmIsReadyAreNamed) {
  auto publisher = peer->publish<PoseStampedMessage>(settings.hand);
  ASSERT_TRUE(publisher);
  SessionSnapshot snapshot;
  const auto notices_after = [&](double seconds, SupervisionState state, bool heeded = true) {
    snapshot.tools[0].state = state;
    for (int i = 0; i < std::lround(seconds / 0.04); ++i) {
      send(*publisher, {}, frame);
      clock.advance(0.04);
      bridge->poll(clock.now());
      bridge->publish(snapshot, heeded);
    }
    return bridge->take_notices().size();
  };
  EXPECT_EQ(notices_after(2.0, SupervisionState::kIdle), 0u);
  EXPECT_EQ(notices_after(0.5, SupervisionState::kReady), 0u);
  EXPECT_EQ(notices_after(2.0, SupervisionState::kEngaged), 0u);
  EXPECT_EQ(notices_after(2.0, SupervisionState::kReady, false), 0u) << "a client at the page has control";
  EXPECT_EQ(notices_after(2.0, SupervisionState::kReady), 1u);
  EXPECT_EQ(notices_after(2.0, SupervisionState::kReady), 0u) << "once";
}

TEST_F(Ros2BridgeTest, AHandWhoseClockIsSetLeadsOn) {
  auto publisher = peer->publish<PoseStampedMessage>(settings.hand);
  ASSERT_TRUE(publisher);
  for (const Time set : {0h, 1h, 0h, 24h, 23h}) {
    for (int i = 0; i < 20; ++i) {
      send(*publisher, {}, frame, 1000h + set + clock.now() - 10ms);
      EXPECT_LE(samples.back().stamp.hand, clock.now());
      EXPECT_LT(clock.now() - samples.back().stamp.hand, 50ms) << set.count();
      clock.advance(0.02);
    }
  }
}

/// On a thread of DDS, through whose code nothing may be thrown.
TEST_F(Ros2BridgeTest, WhatAListenerThrowsIsToldAndItGoesOn) {
  auto publisher = peer->publish<PoseStampedMessage>(settings.hand);
  ASSERT_TRUE(publisher);
  throws = true;
  send(*publisher, {}, frame);
  EXPECT_EQ(failures, std::vector<std::string>{"no memory"});
  throws = false;
  send(*publisher, {}, frame);
  EXPECT_EQ(samples.size(), 1u);
  EXPECT_EQ(failures.size(), 1u);
}

}  // namespace
}  // namespace steadyhand
