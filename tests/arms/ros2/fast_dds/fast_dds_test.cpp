// Fast DDS, the middleware that most ROS 2 machines run, finds this program's topics, matches their QoS, and reads and
// writes their messages; its types are written here by hand, from the .msg files.
#include <fastcdr/Cdr.h>
#include <fastcdr/config.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <gtest/gtest.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "steadyhand/arms/ros2/node.hpp"
#include "support/ros2/lockstep.hpp"

namespace steadyhand {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

struct FastHeader {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  std::string frame;
};
struct FastJointState {
  static constexpr const char* kName = "sensor_msgs::msg::dds_::JointState_";
  FastHeader header;
  std::vector<std::string> names;
  std::vector<double> q, dq, effort;
};
struct FastPoint {
  std::vector<double> q, dq, ddq, effort;
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};
struct FastTrajectory {
  static constexpr const char* kName = "trajectory_msgs::msg::dds_::JointTrajectory_";
  FastHeader header;
  std::vector<std::string> names;
  std::vector<FastPoint> points;
};

/// Each field in the order of the .msg file, written or read.
template <typename Fields>
void go_through(FastHeader& h, Fields&& field) {
  field(h.sec);
  field(h.nanosec);
  field(h.frame);
}
template <typename Fields>
void go_through(FastJointState& m, Fields&& field) {
  go_through(m.header, field);
  field(m.names);
  field(m.q);
  field(m.dq);
  field(m.effort);
}
template <typename Fields>
void go_through(FastTrajectory& m, Fields&& field) {
  go_through(m.header, field);
  field(m.names);
  auto count = static_cast<std::uint32_t>(m.points.size());
  field(count);
  m.points.resize(count);
  for (FastPoint& point : m.points) {
    field(point.q);
    field(point.dq);
    field(point.ddq);
    field(point.effort);
    field(point.sec);
    field(point.nanosec);
  }
}

template <typename Message>
class FastType final : public dds::TopicDataType {
 public:
  FastType() {
    setName(Message::kName);
    m_typeSize = 1 << 16;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr = make_cdr(buffer);
    cdr.serialize_encapsulation();
    go_through(*static_cast<Message*>(data), [&](auto& field) { cdr << field; });
    payload->encapsulation = CDR_LE;
#if FASTCDR_VERSION_MAJOR > 1
    payload->length = static_cast<std::uint32_t>(cdr.get_serialized_data_length());
#else
    payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
#endif
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr = make_cdr(buffer);
    cdr.read_encapsulation();
    go_through(*static_cast<Message*>(data), [&](auto& field) { cdr >> field; });
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [this] { return m_typeSize; };
  }
  void* createData() override { return new Message; }
  void deleteData(void* data) override { delete static_cast<Message*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }

 private:
  static Cdr make_cdr(FastBuffer& buffer) {
#if FASTCDR_VERSION_MAJOR > 1
    return Cdr(buffer, Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::CdrVersion::DDS_CDR);
#else
    return Cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
#endif
  }
};

/// A participant that stays on this computer and needs no multicast.
class FastDds : public testing::Test {
 protected:
  FastDds() : domain(isolated_ros2_domain()) {
    dds::DomainParticipantQos qos = dds::PARTICIPANT_QOS_DEFAULT;
    const auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.emplace_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    for (int i = 0; i < 20; ++i) {
      rtps::Locator_t peer;
      rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
      peer.port = static_cast<std::uint32_t>(7410 + 250 * domain + 2 * i);
      qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    }
    participant = dds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    EXPECT_NE(participant, nullptr);
    auto opened = Ros2Node::open(domain);
    EXPECT_TRUE(opened);
    node = std::move(*opened);
  }
  ~FastDds() override {
    node.reset();
    participant->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  template <typename Message>
  dds::Topic* topic(const std::string& name) {
    dds::TypeSupport type(new FastType<Message>);
    type.register_type(participant);
    return participant->create_topic("rt" + name, Message::kName, dds::TOPIC_QOS_DEFAULT);
  }
  static std::string own(const std::string& name) { return "/fast" + std::to_string(getpid()) + name; }
  static bool wait_until(const std::function<bool()>& condition) {
    for (int i = 0; i < 6000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  int domain;
  dds::DomainParticipant* participant = nullptr;
  std::unique_ptr<Ros2Node> node;
};

TEST_F(FastDds, ItsJointStatesAreHeardReliableOrNot) {
  for (const bool reliable : {true, false}) {
    const std::string name = own(reliable ? "/reliable" : "/best_effort");
    struct Heard {
      std::mutex mutex;
      std::vector<std::string> names;
      std::vector<double> q, dq;
    };
    const auto heard = std::make_shared<Heard>();  // more may come until the node ends
    ASSERT_TRUE(node->listen<JointStateMessage>(name, [heard](const JointStateMessage& m, Ros2PublisherId) {
      const std::lock_guard lock(heard->mutex);
      heard->names.assign(m.name._buffer, m.name._buffer + m.name._length);
      heard->q.assign(m.position._buffer, m.position._buffer + m.position._length);
      heard->dq.assign(m.velocity._buffer, m.velocity._buffer + m.velocity._length);
    }));
    dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    dds::Publisher* publisher = participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    dds::DataWriter* writer = publisher->create_datawriter(topic<FastJointState>(name), qos);
    ASSERT_NE(writer, nullptr);
    FastJointState state{{12, 34, "base"}, {"elbow", "wrist"}, {0.25, -1.5}, {1e-3, 2e3}, {}};
    EXPECT_TRUE(wait_until([&] {
      writer->write(&state);
      const std::lock_guard lock(heard->mutex);
      return !heard->names.empty();
    }));
    const std::lock_guard lock(heard->mutex);
    EXPECT_EQ(heard->names, state.names);
    EXPECT_EQ(heard->q, state.q);
    EXPECT_EQ(heard->dq, state.dq);
  }
}

TEST_F(FastDds, ItReadsOurTrajectoriesReliably) {
  const std::string name = own("/joint_trajectory");
  dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;  // as the controller's subscription
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  dds::Subscriber* subscriber = participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  dds::DataReader* reader = subscriber->create_datareader(topic<FastTrajectory>(name), qos);
  ASSERT_NE(reader, nullptr);
  auto publisher = node->publish<JointTrajectoryMessage>(name, std::chrono::seconds(60));
  ASSERT_TRUE(publisher);
  ASSERT_TRUE(wait_until([&] { return publisher->subscribers() == 1; })) << "not matched";

  // Long enough to come in several fragments.
  std::vector<std::vector<double>> values(120, {0.5, -0.25, 3.0});
  std::vector<JointTrajectoryPointMessage> points(values.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    values[i][0] = static_cast<double>(i);
    for (auto* field : {&points[i].positions, &points[i].velocities, &points[i].accelerations}) {
      field->_buffer = values[i].data();
      field->_length = field->_maximum = 3;
    }
    points[i].time_from_start = {static_cast<std::int32_t>(i), 5};
  }
  std::vector<std::string> names = {"a", "bc", "def"};
  std::vector<char*> pointers;
  for (std::string& joint : names) pointers.push_back(joint.data());
  std::string frame = "frame";
  JointTrajectoryMessage message{};
  message.header = {{77, 88}, frame.data()};
  message.joint_names = sequence_of<decltype(message.joint_names)>(pointers);
  message.points = sequence_of<decltype(message.points)>(points);

  FastTrajectory received;
  dds::SampleInfo info;
  EXPECT_TRUE(wait_until([&] {
    EXPECT_TRUE(publisher->send(message));
    return reader->take_next_sample(&received, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK &&
           info.valid_data;
  }));
  EXPECT_EQ(received.header.sec, 77);
  EXPECT_EQ(received.header.nanosec, 88u);
  EXPECT_EQ(received.header.frame, frame);
  EXPECT_EQ(received.names, names);
  ASSERT_EQ(received.points.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(received.points[i].q, values[i]);
    EXPECT_EQ(received.points[i].dq, values[i]);
    EXPECT_EQ(received.points[i].ddq, values[i]);
    EXPECT_TRUE(received.points[i].effort.empty());
    EXPECT_EQ(received.points[i].sec, static_cast<std::int32_t>(i));
  }
}

}  // namespace
}  // namespace steadyhand
