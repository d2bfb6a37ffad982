// The fake controller's primary interface, dashboard and Robot API.
#include <fmt/format.h>

#include <algorithm>

#include "support/ur/fake_ur_controller.hpp"

namespace steadyhand {

namespace {

constexpr std::size_t kLongestProgram = 1 << 20;

/// Big-endian bytes of the primary interface.
class Bytes {
 public:
  template <typename T>
  Bytes& put(T value) {
    const T big = big_endian(value);
    text_.append(reinterpret_cast<const char*>(&big), sizeof(big));
    return *this;
  }
  Bytes& put(const std::string& text) {
    text_ += text;
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// With its size before it, and its type.
template <typename Type>
std::string package(Type type, const Bytes& content) {
  return Bytes()
      .put(static_cast<std::uint32_t>(content.text().size() + 5))
      .put(static_cast<std::uint8_t>(type))
      .put(content.text())
      .text();
}

Bytes message(UrMessageType type, double time) {
  Bytes bytes;
  return bytes.put(static_cast<std::uint64_t>(1e6 * time)).put(std::uint8_t{254}).put(static_cast<std::uint8_t>(type));
}

std::string word_of(UrRobotMode mode) {
  static constexpr const char* kModes[] = {"DISCONNECTED", "CONFIRM_SAFETY", "BOOTING", "POWER_OFF",        "POWER_ON",
                                           "IDLE",         "BACKDRIVE",      "RUNNING", "UPDATING_FIRMWARE"};
  const int i = static_cast<int>(mode);
  return i < 0 ? "NO_CONTROLLER" : kModes[i];
}

std::string word_of(UrSafety safety) {
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
  return kSafety[std::min<std::size_t>(static_cast<std::size_t>(safety), 11) - 1];
}

std::string word_of(UrRuntime state) {
  return state == UrRuntime::kPaused ? "PAUSED" : state == UrRuntime::kPlaying ? "PLAYING" : "STOPPED";
}

}  // namespace

// ---------------------------------------------------------------------------------------------- primary interface

void FakeUrController::tell(TextPeer& peer, const std::string& bytes) {
  std::size_t sent = 0;
  const auto span = std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  (void)peer.socket.send(span, sent);  // to who does not read it is lost
}

void FakeUrController::tell_error(TextPeer& peer, int code, int level, const std::string& text) {
  tell(peer, package(UrPackage::kMessage, message(UrMessageType::kError, time_)
                                              .put(std::int32_t{code})
                                              .put(std::int32_t{0})
                                              .put(std::int32_t{level})
                                              .put(std::uint32_t{0})
                                              .put(std::uint32_t{0})
                                              .put(text)));
}

/// "line 12: what" to all.
void FakeUrController::tell_exception(const std::string& error) {
  int line = 1;
  std::size_t at = 0;
  if (error.rfind("line ", 0) == 0 && (at = error.find(": ")) != std::string::npos) line = std::stoi(error.substr(5));
  for (auto& peer : text_peers_) {
    if (peer->dashboard) continue;
    tell(*peer, package(UrPackage::kMessage, message(UrMessageType::kException, time_)
                                                 .put(std::int32_t{line})
                                                 .put(std::int32_t{1})
                                                 .put(error.substr(at > 0 ? at + 2 : 0))));
  }
}

void FakeUrController::tell_state(TextPeer& peer) {
  Bytes mode;
  mode.put(static_cast<std::uint64_t>(1e6 * time_));
  for (const bool flag :
       {true, true, true, false, safety_ == UrSafety::kProtectiveStop, program_ != nullptr, paused_}) {
    mode.put(std::uint8_t{flag});
  }
  mode.put(static_cast<std::int8_t>(mode_.load())).put(std::uint8_t{0}).put(slider_.load()).put(1.0).put(1.0);
  std::string parts = package(UrStatePart::kRobotMode, mode);
  if (!std::exchange(peer.told, true)) {
    tell(peer, package(UrPackage::kMessage, message(UrMessageType::kVersion, time_)
                                                .put(std::uint8_t{9})
                                                .put("URControl")
                                                .put(static_cast<std::uint8_t>(settings_.version.major))
                                                .put(static_cast<std::uint8_t>(settings_.version.minor))
                                                .put(std::int32_t{0})
                                                .put(std::int32_t{0})));
    if (settings_.kinematics) {
      Bytes kinematics;
      for (int i = 0; i < 6; ++i) kinematics.put(std::uint32_t{0});
      for (const auto& values : {settings_.kinematics->theta, settings_.kinematics->a, settings_.kinematics->d,
                                 settings_.kinematics->alpha}) {
        for (const double value : values) kinematics.put(value);
      }
      parts += package(UrStatePart::kKinematics, kinematics.put(std::uint32_t{1}));
    }
  }
  tell(peer, package(UrPackage::kState, Bytes().put(parts)));
}

void FakeUrController::serve_text(TextPeer& peer) {
  for (;;) {
    std::array<std::uint8_t, 4096> bytes;
    std::size_t received = 0;
    const Socket::Outcome outcome = peer.socket.receive(bytes, received);
    peer.text.append(reinterpret_cast<const char*>(bytes.data()), received);
    if (outcome == Socket::Outcome::kClosed || peer.text.size() > kLongestProgram) peer.gone = true;
    if (outcome != Socket::Outcome::kDone || peer.gone) break;
  }
  if (!peer.dashboard) return take_scripts(peer);
  if (settings_.polyscope_x()) return serve_http(peer);
  for (std::size_t end; (end = peer.text.find('\n')) != std::string::npos; peer.text.erase(0, end + 1)) {
    std::string line = peer.text.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    (void)peer.socket.send_all(dashboard(line) + "\n", std::chrono::seconds(1));
  }
}

void FakeUrController::take_scripts(TextPeer& peer) {
  for (;;) {
    peer.text.erase(0, std::min(peer.text.find_first_not_of(" \r\n"), peer.text.size()));
    const std::size_t line = peer.text.find('\n');
    if (line == std::string::npos) return;
    const bool command = peer.text.compare(0, line, "stop program") == 0;
    // A program is whole with an `end` at the beginning of a line.
    const std::size_t end = command ? 0 : peer.text.find("\nend");
    const std::size_t after = command ? line : end == std::string::npos ? end : peer.text.find('\n', end + 1);
    if (after == std::string::npos) return;
    const std::string whole = peer.text.substr(0, after + 1);
    peer.text.erase(0, after + 1);
    if (!peer.writable) {
      tell_error(peer, kUrReadOnly, 3, "this connection is read-only");
    } else if (!command) {
      start_program(whole);
    } else {
      end_program("stopped by a client");
      paused_ = false;
    }
  }
}

void FakeUrController::start_program(const std::string& source) {
  if (!may_move()) return;
  const bool was_paused = std::exchange(paused_, false);
  end_program("replaced by another program");
  if (was_paused) return;  // as the client library found (its #123): what is paused ends, and that is all
  try {
    program_ = std::make_unique<urscript::Program>(source, builtins_, settings_.budget);
  } catch (const urscript::ScriptError& error) {
    last_error_ = error.what();
    tell_exception(last_error_);
  }
}

void FakeUrController::end_program(const std::string& why) {
  if (program_ == nullptr) return;
  program_.reset();
  paused_ = false;
  if (!why.empty()) last_error_ = why;
}

// ---------------------------------------------------------------------------------------------- dashboard, Robot API

std::string FakeUrController::dashboard(const std::string& command) {
  const std::string program = program_ != nullptr ? program_->name() : "<unnamed>";
  if (command == "robotmode") return "Robotmode: " + word_of(mode_.load());
  if (command == "safetystatus") return "Safetystatus: " + word_of(safety_.load());
  if (command == "safetymode") return "Safetymode: " + word_of(safety_.load());
  if (command == "programState") return word_of(runtime()) + " " + program;
  if (command == "running") return fmt::format("Program running: {}", program_ != nullptr && !paused_);
  if (command == "PolyscopeVersion") {
    const ControllerVersion& v = settings_.version;
    return fmt::format("URSoftware {}.{}.{}.{} (Nov 25 2021)", v.major, v.minor, v.bugfix, v.build);
  }
  if (command == "is in remote control") return remote_ ? "true" : "false";
  if (command == "get robot model") return "UR5";
  if (command == "get serial number") return "20195500000";
  if (command == "stop") {
    end_program("stopped at the dashboard");
    paused_ = false;
    return "Stopped";
  }
  if (command == "play") return press_play() ? "Starting program" : "Failed to execute: play";
  if (command == "pause") {
    if (program_ == nullptr || paused_) return "Failed to execute: pause";
    paused_ = true;
    return "Pausing program";
  }
  if (command == "unlock protective stop") {
    return try_unlock() ? "Protective stop releasing"
                        : "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective "
                          "stop before unlocking";
  }
  if (command == "close popup" || command == "close safety popup") return "closing popup";
  if (command.rfind("popup ", 0) == 0) return "showing popup";
  if (command == "quit") return "Disconnected";
  return fmt::format("could not understand: '{}'", command);
}

void FakeUrController::serve_http(TextPeer& peer) {
  const std::size_t head = peer.text.find("\r\n\r\n");
  if (head == std::string::npos) return;
  std::size_t length = 0;
  for (const char* name : {"\r\nContent-Length: ", "\r\ncontent-length: "}) {
    const std::size_t at = peer.text.find(name);
    if (at < head) length = std::stoul(peer.text.substr(at + std::string(name).size()));
  }
  if (peer.text.size() < head + 4 + length) return;
  const std::size_t first = peer.text.find(' '), second = peer.text.find(' ', first + 1);
  int status = 200;
  const std::string body = robot_api(peer.text.substr(0, first), peer.text.substr(first + 1, second - first - 1),
                                     peer.text.substr(head + 4, length), status);
  const std::string answer = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}", status,
      status == 200 ? "OK" : "Not OK", body.size(), body);
  (void)peer.socket.send_all(answer, std::chrono::seconds(1));
  peer.gone = true;
}

/// As PolyScope X has it from 10.11; what only 10.12 knows is not found before.
std::string FakeUrController::robot_api(const std::string& method, const std::string& path, const std::string& body,
                                        int& status) {
  const std::string base = "/universal-robots/robot-api";
  const bool newer = settings_.version.minor >= 12;
  if (path.rfind(base, 0) == 0) {
    const std::string place = path.substr(base.size());
    const auto asks = [&](const char* action) { return body.find(fmt::format("\"{}\"", action)) != std::string::npos; };
    if (place == "/openapi.json") return fmt::format(R"({{"info": {{"version": "{}"}}}})", newer ? "3.1.4" : "3.0.0");
    if (place == "/program/v1/state" && method == "GET") return fmt::format(R"({{"state":"{}"}})", word_of(runtime()));
    if (place == "/program/v1/state" && asks("stop")) {
      (void)dashboard("stop");
      return R"({"state":"STOPPED","message":"Program state changed: STOPPED","details":"Stop successful"})";
    }
    if (place == "/robotstate/v1/state" && asks("UNLOCK_PROTECTIVE_STOP")) {
      if (try_unlock()) return R"({"message":"Protective stop unlocked"})";
      status = 409;
      return R"({"message":"Cannot unlock protective stop until 5s after occurrence"})";
    }
    if (newer && place == "/robotstate/v1/robotmode") return fmt::format(R"({{"mode":"{}"}})", word_of(mode_.load()));
    if (newer && place == "/robotstate/v1/safetymode") {
      return fmt::format(R"({{"mode":"{}"}})", word_of(safety_.load()));
    }
    if (newer && place == "/system/v1/controlmode") {
      return fmt::format(R"({{"mode":"{}"}})", remote_ ? "REMOTE" : "LOCAL");
    }
  }
  status = 404;
  return R"({"message":"not found"})";
}

}  // namespace steadyhand
