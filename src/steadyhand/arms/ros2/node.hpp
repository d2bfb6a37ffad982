#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/arms/ros2/types.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Number of the publisher that sent a message; unique in this process.
using Ros2PublisherId = std::uint64_t;

/// A ROS 2 domain: `wanted`, or, if that is -1, the one that ROS_DOMAIN_ID names, or 0. Fails on what is no domain.
Result<int> ros2_domain(int wanted = -1);

/// Cyclone DDS's configuration with which others are found as ROS nodes find each other: by
/// ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_STATIC_PEERS, then CYCLONEDDS_URI, which wins. Nodes on this computer are
/// found with every range, also those that do not listen to multicast. Fails on a range that finds no node.
Result<std::string> ros2_discovery();

/// Asks for real-time priority for the calling thread and those that it makes, below that of control. Without it, load
/// on the machine delays them.
void prefer_this_thread();

/// A topic of ROS, or a service's requests or replies, which are topics on DDS too.
struct Ros2Topic {
  enum class Kind { kTopic, kRequest, kReply };
  std::string name;  ///< as ROS writes it, e.g. "/joint_states"
  Kind kind = Kind::kTopic;
  bool every = false;  ///< each message counts: services and actions

  Ros2Topic(std::string topic) : name(std::move(topic)) {}
  Ros2Topic(const char* topic) : name(topic) {}
  Ros2Topic(std::string topic, Kind which, bool all) : name(std::move(topic)), kind(which), every(all) {}
};

/// A topic that this program publishes on. One thread at a time.
template <typename Message>
class Ros2Publisher {
 public:
  Ros2Publisher() = default;
  explicit Ros2Publisher(dds_entity_t writer) : writer_(writer) {}
  /// Never waits for a subscriber. May take a while, and locks.
  bool send(const Message& message) { return dds_write(writer_, &message) == DDS_RETCODE_OK; }
  /// Subscribers with which it has matched.
  int subscribers() const {
    dds_publication_matched_status_t status{};
    return dds_get_publication_matched_status(writer_, &status) == DDS_RETCODE_OK
               ? static_cast<int>(status.current_count)
               : 0;
  }

 private:
  dds_entity_t writer_ = 0;
};

/// A topic that this program listens to.
class Ros2Subscription {
 public:
  Ros2Subscription() = default;
  explicit Ros2Subscription(dds_entity_t reader) : reader_(reader) {}
  /// Publishers with which it has matched, each as the number of its DDS vendor in RTPS's list.
  std::vector<int> publishers() const;

 private:
  dds_entity_t reader_ = 0;
};

/// Takes part in a ROS 2 domain over DDS, without ROS: topics are those that ROS nodes see under the same name.
class Ros2Node {
 public:
  using OnFailure = std::function<void(const char* what)>;
  /// @param domain 0 to 232 @param realtime whether the threads of DDS ask for real-time priority
  /// @param failed called if a callback throws, on its thread of DDS, with the exception's text; must not throw
  static Result<std::unique_ptr<Ros2Node>> open(int domain, bool realtime = false, OnFailure failed = {});
  /// After it no callback runs.
  ~Ros2Node();
  Ros2Node(const Ros2Node&) = delete;
  Ros2Node& operator=(const Ros2Node&) = delete;

  int domain() const { return domain_; }

  /// Reliable, volatile, the newest message only: ROS nodes' default subscriptions match this.
  /// @param lifespan after which a message that has not arrived is not sent again; 0: never
  template <typename Message>
  Result<Ros2Publisher<Message>> publish(const Ros2Topic& topic, Time lifespan = Time(0)) {
    const Result<dds_entity_t> writer = make_writer(type_of(static_cast<Message*>(nullptr)), topic, lifespan);
    if (!writer) return writer.error();
    return Ros2Publisher<Message>(*writer);
  }

  /// Calls `on_message` for each message of others, on a thread of DDS, one after the other; it must be quick. Matches
  /// with every publisher of the type, reliable or not, but where each message counts.
  template <typename Message>
  Result<Ros2Subscription> subscribe(const Ros2Topic& topic,
                                     std::function<void(const Message&, Ros2PublisherId)> on_message) {
    const Result<dds_entity_t> reader =
        make_reader(type_of(static_cast<Message*>(nullptr)), topic,
                    [on_message = std::move(on_message)](const void* message, Ros2PublisherId publisher) {
                      on_message(*static_cast<const Message*>(message), publisher);
                    });
    if (!reader) return reader.error();
    return Ros2Subscription(*reader);
  }
  template <typename Message>
  Status listen(const Ros2Topic& topic, std::function<void(const Message&, Ros2PublisherId)> on_message) {
    const Result<Ros2Subscription> made = subscribe<Message>(topic, std::move(on_message));
    if (!made) return made.error();
    return Done{};
  }

 private:
  using OnMessage = std::function<void(const void*, Ros2PublisherId)>;
  struct Listener {
    OnMessage on_message;
    OnFailure failed;
  };
  Ros2Node(int domain, dds_entity_t participant, OnFailure failed)
      : domain_(domain), participant_(participant), failed_(std::move(failed)) {}
  static void take(dds_entity_t reader, void* listener);
  Result<dds_entity_t> make_topic(const Ros2Type& type, const Ros2Topic& topic);
  Result<dds_entity_t> make_writer(const Ros2Type& type, const Ros2Topic& topic, Time lifespan);
  Result<dds_entity_t> make_reader(const Ros2Type& type, const Ros2Topic& topic, OnMessage on_message);

  int domain_;
  dds_entity_t participant_;
  OnFailure failed_;
  std::vector<std::unique_ptr<Listener>> listeners_;
};

}  // namespace steadyhand
