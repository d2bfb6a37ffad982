// Messages of ROS 2 as bytes from the wire: through Cyclone DDS, which decodes them, to all its listeners here. The
// first byte states whether the arm follows commands by then. Then, for each message: a byte for the topic; one with
// the cycles of control after it and whether a healthy machine sends its states in them (bit 7); two with the length;
// the message's bytes.
#include <dds/ddsi/ddsi_serdata.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include "fuzz/fuzz.hpp"
#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ros2/ros2_arm.hpp"
#include "steadyhand/arms/ros2/ros2_bridge.hpp"
#include "steadyhand/arms/ros2/ros2_link_check.hpp"
#include "steadyhand/arms/ros2/stamps.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "support/manual_clock.hpp"

namespace steadyhand {
namespace {

using fuzz::require;

constexpr int kReady = 48;  ///< cycles after which the arm follows

template <typename T>
T take(std::string_view& input) {
  T value{};
  const std::size_t size = std::min(sizeof(T), input.size());
  std::memcpy(&value, input.data(), size);
  input.remove_prefix(size);
  return value;
}

/// A topic on which bytes are sent as if they came over the wire, and messages as well.
class Wire {
 public:
  template <typename Message>
  void open(dds_entity_t participant, const std::string& topic, Message message) {
    const dds_entity_t entity =
        dds_create_topic(participant, type_of(&message).descriptor, ("rt" + topic).c_str(), nullptr, nullptr);
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
    writer_ = dds_create_writer(participant, entity, qos, nullptr);
    // A message that is taken back encoded knows how its type is decoded.
    const dds_entity_t reader = dds_create_reader(participant, entity, qos, nullptr);
    dds_delete_qos(qos);
    dds_sample_info_t info;
    require(writer_ > 0 && reader > 0 && dds_write(writer_, &message) == DDS_RETCODE_OK &&
                dds_takecdr(reader, &sample_, 1, &info, DDS_ANY_STATE) == 1,
            "a topic");
    (void)dds_delete(reader);
  }
  template <typename Message>
  void send(const Message& message) {
    require(dds_write(writer_, &message) == DDS_RETCODE_OK, "a message");
  }
  /// @return whether DDS took them for a message
  bool send_bytes(std::string_view bytes) {
    ddsrt_iovec_t piece;
    piece.iov_base = const_cast<char*>(bytes.data());
    piece.iov_len = bytes.size();
    ddsi_serdata* message = ddsi_serdata_from_ser_iov(sample_->type, SDK_DATA, 1, &piece, bytes.size());
    if (message == nullptr) return false;
    (void)dds_writecdr(writer_, message);
    return true;
  }

 private:
  dds_entity_t writer_ = 0;
  ddsi_serdata* sample_ = nullptr;  ///< never freed: as long as the process
};

/// DDS stays in this process: it looks for no other participants, so sessions begin and end quickly.
Ros2Settings settings_of_this_process() {
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SYSTEM_DEFAULT", 1);
  setenv("CYCLONEDDS_URI",
         "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
         "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>none</ParticipantIndex>"
         "</Discovery></Domain></CycloneDDS>",
         1);
  Ros2Settings settings;
  const std::string mine = "/fuzz" + std::to_string(getpid());
  settings.domain = 1 + static_cast<int>(getpid() % 100);
  settings.controller = mine;
  settings.joint_states = mine + "/joint_states";
  settings.speed_scaling = mine + "/speed_scaling";
  settings.hand = mine + "/hand";
  settings.control_rate_hz = 100.0;  // few cycles until it follows
  settings.settle = 0.05;
  return settings;
}

/// The machine on the other side; it lives as long as the process.
struct Machine {
  Machine() {
    std::mt19937 random(3);
    model = random_arm(6, random, false);
    for (Joint& joint : model.joints) names.push_back(joint.name.data());
    q.assign(6, 0.0);
    const dds_entity_t participant =
        dds_create_participant(static_cast<dds_domainid_t>(settings.domain), nullptr, nullptr);
    char nothing[] = "";
    JointStateMessage state{};
    JointTrajectoryMessage trajectory{};
    ControllerStateMessage told{};
    PoseStampedMessage pose{};
    state.header.frame_id = trajectory.header.frame_id = told.header.frame_id = pose.header.frame_id = nothing;
    states.open(participant, settings.joint_states, state);
    told_.open(participant, settings.controller + "/controller_state", told);
    trajectories.open(participant, settings.controller + "/joint_trajectory", trajectory);
    scaling.open(participant, settings.speed_scaling, Float64Message{100.0});
    hand.open(participant, settings.hand, pose);
    require(static_cast<bool>(node->listen<JointTrajectoryMessage>(
                settings.controller + "/joint_trajectory",
                [this](const JointTrajectoryMessage& message, Ros2PublisherId) { check(message); })),
            "a listener");
  }
  /// Sends what a healthy controller sends in each cycle.
  void cycle(Time now) {
    JointStateMessage state{};
    state.header = {stamp_of<builtin_interfaces_msg_dds__Time_>(now), empty};
    state.name = sequence_of<decltype(state.name)>(names);
    state.position = sequence_of<dds_sequence_double>(q);
    states.send(state);
    ControllerStateMessage controller{};
    controller.header = state.header;
    controller.joint_names = sequence_of<decltype(controller.joint_names)>(names);
    controller.reference.positions = state.position;
    told_.send(controller);
  }
  /// No input commands a motion: all that the arm may send holds its position.
  void check(const JointTrajectoryMessage& message) {
    if (!arm_sends) return;
    require(message.joint_names._length == 6 && message.points._length > 0, "a trajectory");
    require(message.header.stamp.sec >= 0 && message.header.stamp.nanosec < 1000000000, "its stamp");
    Time last = Time::min();
    for (std::uint32_t i = 0; i < message.points._length; ++i) {
      const JointTrajectoryPointMessage& point = message.points._buffer[i];
      const Time time = std::chrono::seconds(point.time_from_start.sec) + Time(point.time_from_start.nanosec);
      require(time > last && time < std::chrono::hours(1), "times that increase");
      last = time;
      require(point.positions._length == 6 && point.velocities._length == 6, "all joints");
      for (int j = 0; j < 6; ++j) {
        require(point.positions._buffer[j] >= model.position_min[j] - 1e-9 &&
                    point.positions._buffer[j] <= model.position_max[j] + 1e-9,
                "a place within limits");
        require(point.velocities._buffer[j] == 0.0, "at rest");
      }
    }
  }

  Ros2Settings settings = settings_of_this_process();
  RobotModel model;
  std::vector<char*> names;
  std::vector<double> q;
  char empty[1] = {};
  std::unique_ptr<Ros2Node> node = [this] {
    auto opened = Ros2Node::open(settings.domain);
    require(static_cast<bool>(opened), "a node");
    return std::move(*opened);
  }();
  bool arm_sends = false;
  Wire states, told_, trajectories, scaling, hand;
};

/// An arm, a bridge and a check of the link.
class HostileController {
 public:
  explicit HostileController(Machine& machine) : machine_(&machine) {
    auto arm = Ros2Arm::without_thread(machine.model, machine.settings, clock_);
    auto bridge = Ros2Bridge::open(
        machine.model, {}, machine.settings, clock_, [this](const OperatorSample& sample) { check(sample); },
        [](const char*) { require(false, "nothing is thrown"); });
    require(arm && bridge, "an arm");
    arm_ = std::move(*arm);
    bridge_ = std::move(*bridge);
  }
  ~HostileController() { machine_->arm_sends = false; }

  void warm_up() {
    machine_->scaling.send(Float64Message{100.0});
    for (int i = 0; i < kReady; ++i) {
      machine_->cycle(clock_.now());
      cycle();
    }
    require(state_.status == ArmStatus::kFollowing, "it follows");
  }
  /// A hold, as control commands it.
  void cycle() {
    state_ = arm_->receive();
    const Time now = state_.joints.stamp.made;
    require(state_.joints.q.size() == 6 && state_.joints.q.allFinite() && state_.joints.dq.allFinite(), "a state");
    require(state_.status != ArmStatus::kStopped || !state_.reason.empty(), "a stop says why");
    require(state_.reason.find("failed") == std::string_view::npos, "nothing is thrown");
    if (state_.status == ArmStatus::kFollowing) {
      const JointVector zero = JointVector::Zero(6);
      stand(machine_->model.home, now, plan_);
      arm_->follow(plan_);
      arm_->send({{now, now}, machine_->model.home, zero, zero});
    }
    machine_->arm_sends = true;
    arm_->talk();
    machine_->arm_sends = false;
    bridge_->poll(now);
  }
  void take_message(std::string_view& input) {
    const auto topic = take<std::uint8_t>(input);
    const auto cycles = take<std::uint8_t>(input);
    const std::size_t told = take<std::uint16_t>(input), length = std::min(told, input.size());
    std::string_view bytes = input.substr(0, length);
    input.remove_prefix(length);
    const std::array wires = {&machine_->states, &machine_->told_, &machine_->trajectories, &machine_->scaling,
                              &machine_->hand};
    if (topic % 6 < wires.size()) {
      (void)wires[topic % 6]->send_bytes(bytes);
    } else {
      const builtin_interfaces_msg_dds__Time_ stamp = take<builtin_interfaces_msg_dds__Time_>(bytes);
      meter_.state(clock_.now(), time_of(stamp), topic);
      meter_.slowed_down(take<double>(bytes));
    }
    for (int i = 0; i < cycles % 16; ++i) {
      if (cycles & 0x80) machine_->cycle(clock_.now());
      cycle();
    }
  }
  void judge_link() const {
    const Ros2LinkReport report = meter_.report(1);
    for (const std::string& finding : judge(report, machine_->settings, machine_->model).findings)
      require(!finding.empty(), "words");
  }

 private:
  void check(const OperatorSample& sample) const {
    if (!sample.tracked) return;
    require(sample.X_operator_hand.p.allFinite(), "a hand somewhere");
    require(std::abs(sample.X_operator_hand.q.norm() - 1.0) < 1e-9, "a hand's rotation");
    require(sample.stamp.hand <= sample.stamp.made && sample.stamp.made <= clock_.now(), "no hand of the future");
  }

  Machine* machine_;
  ManualClock clock_;
  ArmState state_;
  Plan plan_;
  Ros2LinkMeter meter_;
  std::unique_ptr<Ros2Arm> arm_;
  std::unique_ptr<Ros2Bridge> bridge_;
};

}  // namespace

FUZZ(cdr) {
  if (input.size() < 6) return;
  static Machine& machine = *new Machine;  // its threads must not outlive what they use
  HostileController session(machine);
  if (take<std::uint8_t>(input) % 2 == 1) session.warm_up();
  while (!input.empty()) session.take_message(input);
  session.judge_link();
}

}  // namespace steadyhand
