#include "support/ur/fake_ur_controller.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace steadyhand {

namespace {

constexpr double kHeldBack = 20.0;  ///< rad/s^2, at which a controller stops an arm that no program moves
constexpr std::size_t kLongestProgram = 1 << 20, kLongestQueue = 20000;

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
                            {"payload", "DOUBLE"},
                            {"payload_cog", "VECTOR3D"},
                            {"payload_inertia", "VECTOR6D"},
                            {"ft_raw_wrench", "VECTOR6D"},
                            {"actual_current_as_torque", "VECTOR6D"},
                            {"output_bit_registers0_to_31", "UINT32"},
                            {"output_bit_registers32_to_63", "UINT32"}};
constexpr Output kLive[] = {
    {"timestamp", "DOUBLE"},         {"target_q", "VECTOR6D"},           {"target_qd", "VECTOR6D"},
    {"target_qdd", "VECTOR6D"},      {"actual_q", "VECTOR6D"},           {"actual_qd", "VECTOR6D"},
    {"robot_mode", "INT32"},         {"safety_mode", "INT32"},           {"safety_status", "INT32"},
    {"robot_status_bits", "UINT32"}, {"safety_status_bits", "UINT32"},   {"runtime_state", "UINT32"},
    {"speed_scaling", "DOUBLE"},     {"target_speed_fraction", "DOUBLE"}};
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

FakeUrController::FakeUrController(const RobotModel& model, const Settings& settings)
    : settings_(settings), model_(model), target_(model.home), target_dq_(JointVector::Zero(6)) {
  model_.velocity_max *= 1.2;
  // servoj smooths over its lookahead: of a step between set-points the joints feel a fifteenth at 500 Hz.
  model_.acceleration_max *= 40.0;
  SimulatedArmSettings arm;
  arm.rate_hz = settings.version.rate_hz();
  arm.latency = 0.0;
  arm.servo_lag = settings.lookahead;
  arm.start_time = 0.0;
  arm_ = std::make_unique<SimulatedArm>(model_, model.home, arm, arm_clock_);
  measured_ = arm_->receive();
  make_builtins();
}

FakeUrController::~FakeUrController() {
  stop();
  program_.reset();
}

// ---------------------------------------------------------------------------------------------- connections

Status FakeUrController::listen() {
  const std::uint16_t wanted[] = {settings_.rtde_port, settings_.script_port, settings_.dashboard_port};
  for (int i = 0; i < 3; ++i) {
    Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int on = 1;
    (void)setsockopt(socket.descriptor(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(wanted[i]);
    if (inet_pton(AF_INET, settings_.address.c_str(), &address.sin_addr) != 1) {
      return Error{fmt::format("'{}' is no IPv4 address", settings_.address)};
    }
    socklen_t size = sizeof(address);
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    if (::bind(socket.descriptor(), generic, size) != 0 || ::listen(socket.descriptor(), 8) != 0 ||
        ::getsockname(socket.descriptor(), generic, &size) != 0) {
      return Error{fmt::format("cannot listen on {}:{} ({})", settings_.address, wanted[i], std::strerror(errno))};
    }
    ports_[i] = ntohs(address.sin_port);
    listeners_[i] = std::move(socket);
  }
  return Done{};
}

void FakeUrController::accept_rtde(Socket socket) {
  rtde_peers_.push_back(std::make_unique<RtdePeer>());
  rtde_peers_.back()->socket = std::move(socket);
}

void FakeUrController::accept_script(Socket socket) {
  text_peers_.push_back(std::make_unique<TextPeer>());
  text_peers_.back()->socket = std::move(socket);
}

void FakeUrController::accept_all() {
  for (int i = 0; i < 3; ++i) {
    if (!listeners_[i]) continue;
    for (;;) {
      Socket socket(::accept4(listeners_[i].descriptor(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (!socket) break;
      if (i == 0) {
        accept_rtde(std::move(socket));
        continue;
      }
      accept_script(std::move(socket));
      if (i != 2) continue;
      text_peers_.back()->dashboard = true;
      (void)text_peers_.back()->socket.send_all("Connected: Universal Robots Dashboard Server\n",
                                                std::chrono::seconds(1));
    }
  }
}

void FakeUrController::serve() {
  accept_all();
  for (auto& peer : rtde_peers_) serve_rtde(*peer);
  for (auto& peer : text_peers_) serve_text(*peer);
  std::erase_if(rtde_peers_, [](const auto& peer) { return peer->gone; });
  std::erase_if(text_peers_, [](const auto& peer) { return peer->gone; });
}

// ---------------------------------------------------------------------------------------------- RTDE

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
  if (peer.queue.size() > kLongestQueue) peer.gone = true;  // nobody reads
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

void FakeUrController::say(const std::string& message) {
  for (auto& peer : rtde_peers_) {
    RtdeWriter writer(RtdeType::kText);
    const std::string cut = message.substr(0, 200), source = "fake";
    if (peer->protocol == 1) {
      writer.put(std::uint8_t{1});
      writer.text(cut);
    } else {
      writer.put(static_cast<std::uint8_t>(cut.size()));
      writer.text(cut);
      writer.put(static_cast<std::uint8_t>(source.size()));
      writer.text(source);
      writer.put(std::uint8_t{1});
    }
    send(*peer, writer);
  }
}

void FakeUrController::put_output(RtdeWriter& writer, const std::string& name, const std::string& type) const {
  const auto vector = [&](const JointVector& values) {
    for (const double value : values) writer.put(value);
  };
  const std::uint32_t running = program_ != nullptr ? kUrProgramRunning : 0u;
  if (name == "timestamp") return writer.put(time_);
  if (name == "target_q") return vector(target_);
  if (name == "target_qd") return vector(target_dq_);
  if (name == "actual_q") return vector(measured_.joints.q);
  if (name == "actual_qd") return vector(measured_.joints.dq);
  if (name == "robot_mode") return writer.put(static_cast<std::int32_t>(mode_.load()));
  if (name == "safety_mode" || name == "safety_status") return writer.put(static_cast<std::int32_t>(safety_.load()));
  if (name == "robot_status_bits") return writer.put(kUrPowerOn | running);
  if (name == "safety_status_bits") return writer.put(std::uint32_t{1} << (static_cast<int>(safety_.load()) - 1));
  if (name == "runtime_state") return writer.put(std::uint32_t{program_ != nullptr ? 2u : 1u});
  if (name == "speed_scaling" || name == "target_speed_fraction") return writer.put(1.0);
  if (const int i = register_of(name, "output_int_register_"); i >= 0) return writer.put(int_out_[i]);
  if (const int i = register_of(name, "output_double_register_"); i >= 0) return writer.put(double_out_[i]);
  if (const int i = register_of(name, "input_int_register_"); i >= 0) return writer.put(int_in_[i]);
  if (const int i = register_of(name, "input_double_register_"); i >= 0) return writer.put(double_in_[i]);
  for (std::size_t k = 0; k < size_of(type); ++k) writer.put(std::uint8_t{0});
}

// ---------------------------------------------------------------------------------------------- scripts, dashboard

void FakeUrController::serve_text(TextPeer& peer) {
  for (;;) {
    std::array<std::uint8_t, 4096> bytes;
    std::size_t received = 0;
    const Socket::Outcome outcome = peer.socket.receive(bytes, received);
    peer.text.append(reinterpret_cast<const char*>(bytes.data()), received);
    if (outcome == Socket::Outcome::kClosed || peer.text.size() > kLongestProgram) peer.gone = true;
    if (outcome != Socket::Outcome::kDone || peer.gone) break;
  }
  if (peer.dashboard) {
    for (std::size_t end; (end = peer.text.find('\n')) != std::string::npos; peer.text.erase(0, end + 1)) {
      std::string line = peer.text.substr(0, end);
      if (!line.empty() && line.back() == '\r') line.pop_back();
      (void)peer.socket.send_all(dashboard(line) + "\n", std::chrono::seconds(1));
    }
    return;
  }
  // A program is whole with an `end` at the beginning of a line.
  for (std::size_t end; (end = ("\n" + peer.text).find("\nend")) != std::string::npos;) {
    const std::size_t after = peer.text.find('\n', end);
    if (after == std::string::npos) break;
    start_program(peer.text.substr(0, after + 1));
    peer.text.erase(0, after + 1);
  }
}

std::string FakeUrController::dashboard(const std::string& command) {
  static constexpr const char* kModes[] = {"DISCONNECTED", "CONFIRM_SAFETY", "BOOTING", "POWER_OFF",        "POWER_ON",
                                           "IDLE",         "BACKDRIVE",      "RUNNING", "UPDATING_FIRMWARE"};
  static constexpr const char* kSafety[] = {"NORMAL",
                                            "REDUCED",
                                            "PROTECTIVE_STOP",
                                            "RECOVERY",
                                            "SAFEGUARD_STOP",
                                            "SYSTEM_EMERGENCY_STOP",
                                            "ROBOT_EMERGENCY_STOP",
                                            "VIOLATION",
                                            "FAULT",
                                            "VALIDATE_JOINT_ID",
                                            "UNDEFINED_SAFETY_MODE"};
  const std::string program = program_ != nullptr ? program_->name() : "<unnamed>";
  const auto safety = static_cast<std::size_t>(safety_.load());
  if (command == "robotmode") {
    const int mode = static_cast<int>(mode_.load());
    return fmt::format("Robotmode: {}", mode < 0 ? "NO_CONTROLLER" : kModes[mode]);
  }
  if (command == "safetystatus") return fmt::format("Safetystatus: {}", kSafety[std::min<std::size_t>(safety, 11) - 1]);
  if (command == "safetymode") return fmt::format("Safetymode: {}", kSafety[std::min<std::size_t>(safety, 11) - 1]);
  if (command == "programState") return (program_ != nullptr ? "PLAYING " : "STOPPED ") + program;
  if (command == "running") return fmt::format("Program running: {}", program_ != nullptr);
  if (command == "PolyscopeVersion") {
    const ControllerVersion& v = settings_.version;
    return fmt::format("URSoftware {}.{}.{}.{} (Nov 25 2021)", v.major, v.minor, v.bugfix, v.build);
  }
  if (command == "is in remote control") return settings_.remote_control ? "true" : "false";
  if (command == "get robot model") return "UR5";
  if (command == "get serial number") return "20195500000";
  if (command == "stop") {
    end_program("stopped at the dashboard");
    return "Stopped";
  }
  if (command == "unlock protective stop") {
    if (safety_ == UrSafety::kProtectiveStop) {
      safety_ = UrSafety::kNormal;
      arm_->restart();
    }
    return "Protective stop releasing";
  }
  if (command == "close popup" || command == "close safety popup") return "closing popup";
  if (command.rfind("popup ", 0) == 0) return "showing popup";
  if (command == "quit") return "Disconnected";
  return fmt::format("could not understand: '{}'", command);
}

void FakeUrController::start_program(const std::string& source) {
  if (!settings_.remote_control || !may_move()) return;
  end_program("replaced by another program");
  try {
    program_ = std::make_unique<urscript::Program>(source, builtins_);
  } catch (const urscript::ScriptError& error) {
    last_error_ = error.what();
    say("compile error: " + last_error_);
  }
}

void FakeUrController::end_program(const std::string& why) {
  if (program_ == nullptr) return;
  program_.reset();
  if (!why.empty()) last_error_ = why;
}

JointVector FakeUrController::joints(const urscript::Value& value) const {
  const urscript::List& entries = urscript::list(value);
  if (entries.size() != 6) throw urscript::ScriptError("six joints are expected");
  JointVector q(6);
  for (int i = 0; i < 6; ++i) q[i] = urscript::number(entries[i]);
  if (!q.allFinite()) throw urscript::ScriptError("joints must be finite");
  return q;
}

void FakeUrController::make_builtins() {
  using namespace urscript;
  const auto six = [](const JointVector& q) {
    List entries;
    for (const double value : q) entries.push_back(value);
    return Value(entries);
  };
  const auto index = [](const Arguments& a) {
    const double i = number(a.get(0, "address", -1.0));
    if (!(i >= 0.0) || i >= 48.0) throw ScriptError("registers are 0 to 47");
    return static_cast<std::size_t>(i);
  };
  const auto nothing = [](const Arguments&, Waiting&) { return Value(); };
  for (const char* name : {"popup", "set_payload", "rtde_set_watchdog", "zero_ftsensor", "end_force_mode",
                           "end_freedrive_mode", "set_gravity", "set_tcp", "force_mode_set_gain_scaling",
                           "force_mode_set_damping", "teach_mode", "end_teach_mode"}) {
    builtins_[name] = nothing;
  }
  builtins_["get_steptime"] = [this](const Arguments&, Waiting&) { return Value(period()); };
  builtins_["get_target_joint_positions"] = [this, six](const Arguments&, Waiting&) { return six(target_); };
  builtins_["get_target_joint_speeds"] = [this, six](const Arguments&, Waiting&) { return six(target_dq_); };
  builtins_["get_actual_joint_positions"] = [this, six](const Arguments&, Waiting&) { return six(measured_.joints.q); };
  builtins_["get_joint_positions"] = builtins_["get_actual_joint_positions"];
  builtins_["get_actual_joint_speeds"] = [this, six](const Arguments&, Waiting&) { return six(measured_.joints.dq); };
  builtins_["is_steady"] = [this](const Arguments&, Waiting&) { return Value(target_dq_.norm() < 1e-9); };
  builtins_["read_input_float_register"] = [this, index](const Arguments& a, Waiting&) {
    return Value(double_in_[index(a)]);
  };
  builtins_["read_input_integer_register"] = [this, index](const Arguments& a, Waiting&) {
    return Value(static_cast<double>(int_in_[index(a)]));
  };
  builtins_["write_output_float_register"] = [this, index](const Arguments& a, Waiting&) {
    double_out_[index(a)] = number(a.get(1, "value", 0.0));
    return Value();
  };
  builtins_["write_output_integer_register"] = [this, index](const Arguments& a, Waiting&) {
    const double value = number(a.get(1, "value", 0.0));
    int_out_[index(a)] = static_cast<std::int32_t>(std::clamp(value, -2147483648.0, 2147483647.0));
    return Value();
  };
  builtins_["textmsg"] = [this](const Arguments& a, Waiting&) {
    if (log_.size() < 1000) log_.push_back(text(a.get(0, "s1", "")) + text(a.get(1, "s2", "")));
    return Value();
  };
  builtins_["str_cat"] = [](const Arguments& a, Waiting&) {
    return Value(text(a.get(0, "", "")) + text(a.get(1, "", "")));
  };
  builtins_["to_str"] = [](const Arguments& a, Waiting&) { return Value(text(a.get(0, "val", ""))); };
  builtins_["norm"] = [](const Arguments& a, Waiting&) {
    const Value value = a.get(0, "a", 0.0);
    if (!std::holds_alternative<List>(value)) return Value(std::abs(number(value)));
    double sum = 0.0;
    for (const Value& each : list(value)) sum += number(each) * number(each);
    return Value(std::sqrt(sum));
  };
  for (const auto& [name, f] : {std::pair(
                                    "floor", +[](double x) { return std::floor(x); }),
                                std::pair(
                                    "ceil", +[](double x) { return std::ceil(x); }),
                                std::pair(
                                    "sqrt", +[](double x) { return std::sqrt(x); })}) {
    builtins_[name] = [f = f](const Arguments& a, Waiting&) { return Value(f(number(a.get(0, "f", 0.0)))); };
  }
  builtins_["sync"] = [](const Arguments&, Waiting& thread) {
    thread.next_cycle();
    return Value();
  };
  builtins_["sleep"] = [this](const Arguments& a, Waiting& thread) {
    for (double left = number(a.get(0, "t", 0.0)); left > 0.5 * period(); left -= period()) thread.next_cycle();
    return Value();
  };
  builtins_["servoj"] = [this](const Arguments& a, Waiting& thread) {
    wanted_ = joints(a.get(0, "q", {}));
    const double lookahead = number(a.get(4, "lookahead_time", 0.1)), gain = number(a.get(5, "gain", 300.0));
    if (lookahead < 0.03 || lookahead > 0.2) throw ScriptError("servoj: lookahead_time is 0.03 to 0.2");
    if (gain < 100.0 || gain > 2000.0) throw ScriptError("servoj: gain is 100 to 2000");
    for (double left = number(a.get(3, "t", 0.002)); left > 0.5 * period(); left -= period()) {
      moves_ = true;
      thread.next_cycle();
    }
    return Value();
  };
  builtins_["speedj"] = [this](const Arguments& a, Waiting& thread) {
    const JointVector goal = joints(a.get(0, "qd", {}));
    const double most = number(a.get(1, "a", 1.4)) * period();
    for (double left = std::max(period(), number(a.get(2, "t", 0.0))); left > 0.5 * period(); left -= period()) {
      const JointVector change = (goal - target_dq_).cwiseMax(-most).cwiseMin(most);
      wanted_ = target_ + period() * (target_dq_ + change);
      moves_ = true;
      thread.next_cycle();
    }
    return Value();
  };
  builtins_["stopj"] = [this](const Arguments& a, Waiting& thread) {
    return brake(number(a.get(0, "a", 2.0)), thread);
  };
  builtins_["stopl"] = [this](const Arguments& a, Waiting& thread) {
    return brake(number(a.get(0, "a", 2.0)), thread);
  };
  builtins_["movej"] = [this](const Arguments& a, Waiting& thread) { return move(a, thread); };
}

/// All joints along one trapezoid of speed.
urscript::Value FakeUrController::move(const urscript::Arguments& a, urscript::Waiting& thread) {
  using namespace urscript;
  const JointVector begin = target_, way = joints(a.get(0, "q", {})) - target_;
  const double distance = way.cwiseAbs().maxCoeff();
  const double acceleration = number(a.get(1, "a", 1.4)), limit = number(a.get(2, "v", 1.05));
  if (!(acceleration > 0.0) || !(limit > 0.0)) throw ScriptError("movej: a and v must be above 0");
  if (distance < 1e-9) return Value();
  const double speed = std::min(limit, std::sqrt(distance * acceleration)), ramp = speed / acceleration;
  const double duration = distance / speed + ramp;
  for (double t = period();; t += period()) {
    const double u = std::min(t, duration), left = duration - u;
    double gone = speed * (u - 0.5 * ramp);
    if (u < ramp) gone = 0.5 * acceleration * u * u;
    if (left < ramp) gone = distance - 0.5 * acceleration * left * left;
    wanted_ = begin + gone / distance * way;
    moves_ = true;
    thread.next_cycle();
    if (t >= duration) return Value();
  }
}

urscript::Value FakeUrController::brake(double deceleration, urscript::Waiting& thread) {
  while (target_dq_.norm() > 1e-9) {
    const JointVector change = target_dq_.cwiseAbs().cwiseMin(std::max(0.1, deceleration) * period());
    wanted_ = target_ + period() * (target_dq_ - target_dq_.cwiseSign().cwiseProduct(change));
    moves_ = true;
    thread.next_cycle();
  }
  return {};
}

// ---------------------------------------------------------------------------------------------- the robot

bool FakeUrController::may_move() const { return mode_ == UrRobotMode::kRunning && why_not(safety_.load()).empty(); }

void FakeUrController::step() {
  ++cycle_;
  spoke_ = false;
  time_ = static_cast<double>(cycle_) * period();
  if (drop_asked_.exchange(false)) {
    rtde_peers_.clear();
    text_peers_.clear();
  }
  if (unplugged_ > 0) --unplugged_;
  if (unplugged_ == 0) serve();
  count_unanswered();
  if (protective_asked_.exchange(false)) arm_->trip("protective stop");
  moves_ = false;
  if (!may_move()) end_program("the robot may not move");
  if (program_ != nullptr && !program_->cycle()) {
    const std::string error = program_->error();
    if (!error.empty()) say("runtime error: " + error);
    end_program(error);
  }
  advance_robot();
  for (auto& peer : rtde_peers_) {
    if (peer->started && time_ + 0.5 * period() > peer->due) {
      peer->due = std::max(peer->due, time_ - period()) + 1.0 / peer->rate_hz;
      RtdeWriter writer(RtdeType::kData);
      if (peer->protocol >= 2) writer.put(peer->output.id);
      for (std::size_t k = 0; k < peer->output.names.size(); ++k) {
        put_output(writer, peer->output.names[k], peer->output.types[k]);
      }
      send(*peer, writer);
    }
    flush(*peer);
  }
  // The script port tells its clients the state ten times a second, whether they want it or not: here an empty one.
  if (cycle_ % 50 != 0 || unplugged_ > 0) return;
  constexpr std::uint8_t kEmptyState[] = {0, 0, 0, 5, 16};
  for (auto& peer : text_peers_) {
    std::size_t sent = 0;
    if (!peer->dashboard) (void)peer->socket.send(kEmptyState, sent);
  }
}

/// By the registers of our program, see docs/universal-robots.md.
void FakeUrController::count_unanswered() {
  constexpr int kAnswer = 24, kFollow = 25, kState = 24, kFollowing = 2;
  const bool follows = program_ != nullptr && int_out_[kState] == kFollowing && int_in_[kFollow] == 1;
  if (follows && int_in_[kAnswer] == last_answer_) ++unanswered_;
  last_answer_ = int_in_[kAnswer];
}

void FakeUrController::advance_robot() {
  const double dt = period();
  JointVector next = wanted_;
  if (!moves_) {
    const JointVector change = target_dq_.cwiseAbs().cwiseMin(kHeldBack * dt);
    next = target_ + dt * (target_dq_ - target_dq_.cwiseSign().cwiseProduct(change));
  }
  const JointVector dq = (next - target_) / dt;
  if (safety_ != UrSafety::kProtectiveStop) {
    largest_acceleration_ = std::max(largest_acceleration_, (dq - target_dq_).cwiseAbs().maxCoeff() / dt);
    largest_speed_ = std::max(largest_speed_, dq.cwiseAbs().maxCoeff());
    const JointVector step = next - target_ - 0.5 * dt * (dq + target_dq_);
    largest_position_step_ = std::max(largest_position_step_, step.cwiseAbs().maxCoeff());
    target_ = next;
    target_dq_ = dq;
    const Time now = measured_.joints.stamp.made;
    arm_->send({{now, now}, target_, target_dq_, JointVector::Zero(6)});
  }
  measured_ = arm_->receive();
  if (measured_.status == ArmStatus::kStopped && safety_ == UrSafety::kNormal) {
    last_error_ = measured_.reason;
    safety_ = UrSafety::kProtectiveStop;
    end_program({});
    say("protective stop: " + last_error_);
  }
  if (safety_ == UrSafety::kProtectiveStop) {  // a stopped arm's target is where it stands
    target_ = arm_->q();
    target_dq_.setZero();
  }
}

void FakeUrController::run() {
  running_ = true;
  thread_ = std::thread([this] {
    MonotonicClock clock;
    const Time cycle = from_seconds(period());
    for (Time next = clock.now(); running_; next = std::max(next + cycle, clock.now() - 5 * cycle)) {
      clock.sleep_until(next);
      step();
    }
  });
}

void FakeUrController::stop() {
  running_ = false;
  if (thread_.joinable()) thread_.join();
}

}  // namespace steadyhand
