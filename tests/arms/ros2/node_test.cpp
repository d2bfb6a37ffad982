#include "steadyhand/arms/ros2/node.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <stdlib.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <thread>

namespace steadyhand {
namespace {

/// A variable of the environment while it lives.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* old = getenv(name)) old_ = old;
    set(value);
  }
  ~Variable() { set(old_ ? old_->c_str() : nullptr); }

 private:
  void set(const char* value) { value == nullptr ? unsetenv(name_) : setenv(name_, value, 1); }
  const char* name_;
  std::optional<std::string> old_;
};

std::string discovery(const char* range, const char* peers = nullptr, const char* own = nullptr) {
  const Variable variables[] = {
      {"ROS_AUTOMATIC_DISCOVERY_RANGE", range}, {"ROS_STATIC_PEERS", peers}, {"CYCLONEDDS_URI", own}};
  const auto found = ros2_discovery();
  return found ? *found : "refused: " + found.error().message;
}

TEST(Ros2Discovery, TheRangeDecidesWhetherThereIsMulticast) {
  const char* none = "<AllowMulticast>false</AllowMulticast>";
  EXPECT_EQ(discovery(nullptr).find(none), std::string::npos);
  EXPECT_EQ(discovery("SUBNET").find(none), std::string::npos);
  EXPECT_NE(discovery("LOCALHOST").find(none), std::string::npos);
  for (const char* range : {"OFF", "localhost", "NEAR"}) {
    EXPECT_EQ(discovery(range).rfind("refused: ROS_AUTOMATIC_DISCOVERY_RANGE is '" + std::string(range) + "'", 0), 0u);
  }
}

TEST(Ros2Discovery, ThisComputerAndStaticPeersAreAskedWhateverTheRange) {
  for (const char* range : {"", "SUBNET", "LOCALHOST"}) {
    const std::string found = discovery(range, "10.0.0.7;;robot.local;");
    EXPECT_NE(found.find("<Peers><Peer address='127.0.0.1'/>"), std::string::npos) << found;
    const std::string last = "<Peer address='10.0.0.7'/><Peer address='robot.local'/></Peers>";
    EXPECT_NE(found.find(last), std::string::npos) << found;
  }
  EXPECT_EQ(discovery("SUBNET", "10.0.0.7;a'/><b").rfind("refused: ROS_STATIC_PEERS has 'a'/><b'", 0), 0u);
}

TEST(Ros2Discovery, CyclonesOwnConfigurationComesLastAndAloneIfAsked) {
  const std::string both = discovery("LOCALHOST", nullptr, "file:///own.xml");
  EXPECT_EQ(both.substr(both.rfind('>')), ">,file:///own.xml");
  EXPECT_EQ(discovery("SYSTEM_DEFAULT", "10.0.0.7", "file:///own.xml"), "file:///own.xml");
}

TEST(Ros2Discovery, ADomainIsSetUpAnewAfterItsLastNode) {
  const Variable variables[] = {{"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}, {"CYCLONEDDS_URI", nullptr}};
  for (int i = 0; i < 2; ++i) {
    const auto one = Ros2Node::open(211);
    ASSERT_TRUE(one) << one.error().message;
    const auto two = Ros2Node::open(211);
    ASSERT_TRUE(two) << two.error().message;
  }
  const Variable wrong("CYCLONEDDS_URI", "<CycloneDDS><Domain><Generally/></Domain></CycloneDDS>");
  const auto refused = Ros2Node::open(211);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("CYCLONEDDS_URI"), std::string::npos);
}

/// The ids of this process's threads that have real-time priority, or of those that have not.
std::set<int> threads(bool realtime) {
  std::set<int> found;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    const int number = std::stoi(thread.path().filename());
    if ((sched_getscheduler(number) == SCHED_FIFO) == realtime) found.insert(number);
  }
  return found;
}

TEST(Ros2Discovery, TheThreadsOfDdsHaveThePriorityThatIsAskedFor) {
  bool permitted = false;
  std::thread([&] {
    prefer_this_thread();
    permitted = sched_getscheduler(0) == SCHED_FIFO;
  }).join();
  if (!permitted) GTEST_SKIP() << "no real-time priority here";
  const Variable range("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
  const std::set<int> ordinary = threads(false);
  const auto node = Ros2Node::open(212, true);
  ASSERT_TRUE(node) << node.error().message;
  EXPECT_GE(threads(true).size(), 4u) << "what receives, delivers and sends";
  EXPECT_EQ(threads(false), ordinary);
}

}  // namespace
}  // namespace steadyhand
