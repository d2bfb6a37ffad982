// The fake controller's RTDE interface.
#include <algorithm>
#include <cstring>

#include "support/ur/fake_ur_controller.hpp"

namespace steadyhand {

namespace {

constexpr std::size_t kLongestQueue = 20000;

struct Output {
  const char *name, *type;
};
/// Variables with which tests have no business: zeros of the right type, so that clients that want all get all.
constexpr Output kIdle[] = {{"target_current", "VECTOR6D"},
                            {"target_moment", "VECTOR6D"},
                            {"actual_current", "VECTOR6D"},
                            {"actual_current_window", "VECTOR6D"},
                            {"joint_control_output", "VECTOR6D"},
                            {"actual_TCP_pose", "VECTOR6D"},
                            {"actual_TCP_speed", "VECTOR6D"},
                            {"actual_TCP_force", "VECTOR6D"},
                            {"target_TCP_pose", "VECTOR6D"},
                            {"target_TCP_speed", "VECTOR6D"},
                            {"actual_digital_input_bits", "UINT64"},
                            {"actual_digital_output_bits", "UINT64"},
                            {"joint_temperatures", "VECTOR6D"},
                            {"actual_execution_time", "DOUBLE"},
                            {"joint_mode", "VECTOR6INT32"},
                            {"actual_tool_accelerometer", "VECTOR3D"},
                            {"actual_momentum", "DOUBLE"},
                            {"actual_main_voltage", "DOUBLE"},
                            {"actual_robot_voltage", "DOUBLE"},
                            {"actual_robot_current", "DOUBLE"},
                            {"actual_joint_voltage", "VECTOR6D"},
                            {"standard_analog_input0", "DOUBLE"},
                            {"standard_analog_input1", "DOUBLE"},
                            {"standard_analog_output0", "DOUBLE"},
                            {"standard_analog_output1", "DOUBLE"},
                            {"io_current", "DOUBLE"},
                            {"tool_mode", "UINT32"},
                            {"tool_output_voltage", "INT32"},
                            {"tool_output_current", "DOUBLE"},
                            {"tcp_force_scalar", "DOUBLE"},
                            {"payload_cog", "VECTOR3D"},
                            {"payload_inertia", "VECTOR6D"},
                            {"ft_raw_wrench", "VECTOR6D"},
                            {"actual_current_as_torque", "VECTOR6D"},
                            {"output_bit_registers0_to_31", "UINT32"},
                            {"output_bit_registers32_to_63", "UINT32"}};
constexpr Output kLive[] = {{"timestamp", "DOUBLE"},
                            {"target_q", "VECTOR6D"},
                            {"target_qd", "VECTOR6D"},
                            {"target_qdd", "VECTOR6D"},
                            {"actual_q", "VECTOR6D"},
                            {"actual_qd", "VECTOR6D"},
                            {"robot_mode", "INT32"},
                            {"safety_mode", "INT32"},
                            {"safety_status", "INT32"},
                            {"robot_status_bits", "UINT32"},
                            {"safety_status_bits", "UINT32"},
                            {"runtime_state", "UINT32"},
                            {"speed_scaling", "DOUBLE"},
                            {"target_speed_fraction", "DOUBLE"},
                            {"payload", "DOUBLE"},
                            {"tcp_offset", "VECTOR6D"}};
constexpr Output kInputs[] = {{"speed_slider_mask", "UINT32"},
                              {"speed_slider_fraction", "DOUBLE"},
                              {"standard_digital_output_mask", "UINT8"},
                              {"standard_digital_output", "UINT8"},
                              {"configurable_digital_output_mask", "UINT8"},
                              {"configurable_digital_output", "UINT8"},
                              {"tool_digital_output_mask", "UINT8"},
                              {"tool_digital_output", "UINT8"},
                              {"standard_analog_output_mask", "UINT8"},
                              {"standard_analog_output_type", "UINT8"},
                              {"standard_analog_output_0", "DOUBLE"},
                              {"standard_analog_output_1", "DOUBLE"},
                              {"external_force_torque", "VECTOR6D"}};

/// i of `PREFIXi`, 0 to 47; -1 for other names.
int register_of(const std::string& name, const char* prefix) {
  const std::size_t size = std::strlen(prefix);
  if (name.compare(0, size, prefix) != 0 || name.size() == size || name.size() > size + 2) return -1;
  int i = 0;
  for (std::size_t k = size; k < name.size(); ++k) {
    if (name[k] < '0' || name[k] > '9') return -1;
    i = 10 * i + (name[k] - '0');
  }
  return i < 48 ? i : -1;
}

template <std::size_t n>
std::string find(const Output (&table)[n], const std::string& name) {
  for (const Output& each : table) {
    if (name == each.name) return each.type;
  }
  return "NOT_FOUND";
}

std::string register_type(const std::string& name, const std::string& direction) {
  if (register_of(name, (direction + "_int_register_").c_str()) >= 0) return "INT32";
  if (register_of(name, (direction + "_double_register_").c_str()) >= 0) return "DOUBLE";
  return "NOT_FOUND";
}

std::string output_type(const std::string& name, const ControllerVersion& version) {
  const bool new_software =
      version.major > 5 || (version.major == 5 && version.minor >= 4) || (version.major == 3 && version.minor >= 10);
  if (name == "safety_status" && !new_software) return "NOT_FOUND";
  for (const std::string& type :
       {find(kLive, name), find(kIdle, name), register_type(name, "output"), register_type(name, "input")}) {
    if (type != "NOT_FOUND") return type;
  }
  return "NOT_FOUND";
}

std::string input_type(const std::string& name) {
  const std::string type = find(kInputs, name);
  return type != "NOT_FOUND" ? type : register_type(name, "input");
}

std::size_t size_of(const std::string& type) {
  if (type == "UINT8") return 1;
  if (type == "UINT32" || type == "INT32") return 4;
  if (type == "VECTOR6D") return 48;
  if (type == "VECTOR3D" || type == "VECTOR6INT32") return 24;
  return 8;
}

}  // namespace

void FakeUrController::serve_rtde(RtdePeer& peer) {
  for (;;) {
    std::size_t received = 0;
    const Socket::Outcome outcome = peer.socket.receive(peer.framer.space(), received);
    peer.framer.filled(received);
    RtdePacket packet;
    while (peer.framer.next(packet)) answer(peer, packet);
    if (outcome == Socket::Outcome::kClosed || peer.framer.broken()) peer.gone = true;
    if (outcome != Socket::Outcome::kDone || peer.gone) return;
  }
}

void FakeUrController::answer(RtdePeer& peer, const RtdePacket& packet) {
  RtdeReader reader(packet.payload);
  RtdeWriter reply(packet.type);
  switch (packet.type) {
    case RtdeType::kRequestVersion: {
      const int version = reader.take<std::uint16_t>();
      const bool accepted = version >= 1 && version <= settings_.newest_protocol;
      if (accepted) peer.protocol = version;
      reply.put(std::uint8_t{accepted});
      break;
    }
    case RtdeType::kControllerVersion:
      for (const std::uint32_t part :
           {settings_.version.major, settings_.version.minor, settings_.version.bugfix, settings_.version.build}) {
        reply.put(part);
      }
      break;
    case RtdeType::kSetupOutputs:
    case RtdeType::kSetupInputs:
      return set_up(peer, packet);
    case RtdeType::kStart:
    case RtdeType::kPause:
      peer.started = packet.type == RtdeType::kStart && !peer.output.names.empty();
      peer.due = time_;
      reply.put(std::uint8_t{packet.type == RtdeType::kPause || peer.started});
      break;
    case RtdeType::kData:
      return take_inputs(peer, reader);
    default:
      return;
  }
  send(peer, reply);
}

void FakeUrController::set_up(RtdePeer& peer, const RtdePacket& packet) {
  const bool outputs = packet.type == RtdeType::kSetupOutputs;
  RtdeReader reader(packet.payload);
  if (outputs && peer.protocol >= 2) {
    const double rate = reader.take<double>();
    const double most = settings_.version.rate_hz();
    peer.rate_hz = rate > 0.0 ? std::min(rate, most) : most;
  }
  std::string names(reader.rest());
  Recipe recipe;
  bool good = true;
  std::string types;
  for (std::size_t at = 0; at < names.size();) {
    const std::size_t comma = std::min(names.find(',', at), names.size());
    const std::string name = names.substr(at, comma - at);
    at = comma + 1;
    if (name.empty()) continue;
    std::string type = outputs ? output_type(name, settings_.version) : input_type(name);
    if (!outputs && type != "NOT_FOUND" && taken_by_other(peer, name)) type = "IN_USE";
    good = good && type != "NOT_FOUND" && type != "IN_USE";
    recipe.names.push_back(name);
    recipe.types.push_back(type);
    types += (types.empty() ? "" : ",") + type;
  }
  good = good && !recipe.names.empty();
  recipe.id = !good ? 0 : outputs ? 1 : static_cast<std::uint8_t>(peer.inputs.size() + 1);
  RtdeWriter reply(packet.type);
  if (!outputs || peer.protocol >= 2) reply.put(recipe.id);
  reply.text(types);
  if (good && outputs) peer.output = std::move(recipe);
  if (good && !outputs) peer.inputs.push_back(std::move(recipe));
  send(peer, reply);
}

bool FakeUrController::taken_by_other(const RtdePeer& peer, const std::string& name) const {
  for (const auto& other : rtde_peers_) {
    if (other.get() == &peer || other->gone) continue;
    for (const Recipe& recipe : other->inputs) {
      if (std::find(recipe.names.begin(), recipe.names.end(), name) != recipe.names.end()) return true;
    }
  }
  return false;
}

void FakeUrController::take_inputs(RtdePeer& peer, RtdeReader data) {
  const int id = data.take<std::uint8_t>();
  if (id < 1 || id > static_cast<int>(peer.inputs.size())) return;
  const Recipe& recipe = peer.inputs[id - 1];
  std::size_t size = 0;
  for (const std::string& type : recipe.types) size += size_of(type);
  if (data.left() != size) return;
  for (std::size_t k = 0; k < recipe.names.size(); ++k) {
    const std::string& name = recipe.names[k];
    if (const int i = register_of(name, "input_int_register_"); i >= 0) {
      int_in_[i] = data.take<std::int32_t>();
    } else if (const int j = register_of(name, "input_double_register_"); j >= 0) {
      double_in_[j] = data.take<double>();
    } else {
      (void)data.text(size_of(recipe.types[k]));
    }
  }
}

void FakeUrController::send(RtdePeer& peer, RtdeWriter& writer) {
  const auto bytes = writer.packet();
  if (peer.queue.size() > kLongestQueue) peer.gone = true;  // the peer does not read
  peer.queue.emplace_back(cycle_ + lag_, std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
  flush(peer);
}

void FakeUrController::flush(RtdePeer& peer) {
  while (!peer.queue.empty() && peer.queue.front().first <= cycle_ && unplugged_ == 0) {
    auto& bytes = peer.queue.front().second;
    std::size_t sent = 0;
    const Socket::Outcome outcome = peer.socket.send(bytes, sent);
    if (outcome == Socket::Outcome::kClosed) peer.gone = true;
    bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(sent));
    if (!bytes.empty()) return;
    spoke_ = true;
    peer.queue.pop_front();
  }
}

void FakeUrController::put_output(RtdeWriter& writer, const std::string& name, const std::string& type) const {
  const auto vector = [&](const JointVector& values) {
    for (const double value : values) writer.put(value);
  };
  const std::uint32_t running = program_ != nullptr ? kUrProgramRunning : 0u;  // also while it is paused [?]
  if (name == "timestamp") return writer.put(time_);
  if (name == "target_q") return vector(target_);
  if (name == "target_qd") return vector(target_dq_);
  if (name == "actual_q") return vector(measured_.joints.q);
  if (name == "actual_qd") return vector(measured_.joints.dq);
  if (name == "robot_mode") return writer.put(static_cast<std::int32_t>(mode_.load()));
  if (name == "safety_mode" || name == "safety_status") return writer.put(static_cast<std::int32_t>(safety_.load()));
  if (name == "robot_status_bits") return writer.put(kUrPowerOn | running);
  if (name == "safety_status_bits") return writer.put(std::uint32_t{1} << (static_cast<int>(safety_.load()) - 1));
  if (name == "runtime_state") return writer.put(static_cast<std::uint32_t>(runtime()));
  if (name == "speed_scaling") return writer.put(1.0);
  if (name == "target_speed_fraction") return writer.put(slider_.load());
  if (name == "payload") return writer.put(settings_.payload);
  if (name == "tcp_offset") {
    for (const double value : settings_.tcp) writer.put(value);
    return;
  }
  if (const int i = register_of(name, "output_int_register_"); i >= 0) return writer.put(int_out_[i]);
  if (const int i = register_of(name, "output_double_register_"); i >= 0) return writer.put(double_out_[i]);
  if (const int i = register_of(name, "input_int_register_"); i >= 0) return writer.put(int_in_[i]);
  if (const int i = register_of(name, "input_double_register_"); i >= 0) return writer.put(double_in_[i]);
  for (std::size_t k = 0; k < size_of(type); ++k) writer.put(std::uint8_t{0});
}

}  // namespace steadyhand
