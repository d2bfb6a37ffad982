#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstdlib>

#include "steadyhand/arms/ur/ur_dashboard.hpp"

namespace steadyhand {

namespace {

constexpr const char* kBase = "/universal-robots/robot-api";
constexpr std::size_t kLongestAnswer = 1 << 22;

/// The text of `"key": "text"` in a JSON object; empty without it.
std::string text_of(const std::string& json, const std::string& key) {
  std::size_t at = json.find('"' + key + '"');
  if (at == std::string::npos) return {};
  at = json.find_first_not_of(" \t\r\n:", at + key.size() + 2);
  if (at == std::string::npos || json[at] != '"') return {};
  const std::size_t end = json.find('"', at + 1);
  return end == std::string::npos ? std::string() : json.substr(at + 1, end - at - 1);
}

}  // namespace

Result<std::string> UrRobotApi::ask(const std::string& path, const std::string& body) {
  auto socket = Socket::connect(host_, port_, timeout_);
  if (!socket) return socket.error();
  const std::string request = fmt::format(
      "{} {}{} HTTP/1.1\r\nHost: {}\r\nAccept: application/json\r\nConnection: close\r\n"
      "Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{}",
      body.empty() ? "GET" : "PUT", kBase, path, host_, body.size(), body);
  if (!socket->send_all(request, timeout_)) return Error{"the Robot API closed the connection"};
  std::string answer;
  const auto until = std::chrono::steady_clock::now() + timeout_;
  for (;;) {
    std::array<std::uint8_t, 4096> bytes;
    std::size_t n = 0;
    const Socket::Outcome outcome = socket->receive(bytes, n);
    answer.append(reinterpret_cast<const char*>(bytes.data()), n);
    if (outcome == Socket::Outcome::kClosed) break;
    if (answer.size() > kLongestAnswer) return Error{"the Robot API's answer has no end"};
    const Time left = until - std::chrono::steady_clock::now();
    if (left <= Time(0)) return Error{"the Robot API does not answer"};
    if (outcome == Socket::Outcome::kNothing) (void)socket->wait_readable(left);
  }
  const std::size_t head = answer.find("\r\n\r\n");
  if (answer.rfind("HTTP/1.", 0) != 0 || head == std::string::npos) {
    return Error{fmt::format("{}:{} speaks no HTTP", host_, port_)};
  }
  const int status = std::atoi(answer.c_str() + std::min(answer.find(' '), answer.size()));
  const std::string content = answer.substr(head + 4);
  if (status == 404) return Error{"not known to this software"};
  if (status != 200) return Error{fmt::format("refused ({}): {}", status, text_of(content, "message"))};
  return content;
}

std::vector<UrPanel::Line> UrRobotApi::state() {
  struct Question {
    const char *name, *path, *key;
  };
  constexpr Question kQuestions[] = {{"robot mode", "/robotstate/v1/robotmode", "mode"},
                                     {"safety mode", "/robotstate/v1/safetymode", "mode"},
                                     {"program", "/program/v1/state", "state"},
                                     {"control", "/system/v1/controlmode", "mode"}};
  std::vector<Line> lines;
  for (const Question& q : kQuestions) {
    const auto answer = ask(q.path);
    lines.push_back({q.name, answer ? text_of(*answer, q.key) : answer.error().message});
  }
  return lines;
}

Result<std::string> UrRobotApi::unlock_protective_stop() {
  const auto answer = ask("/robotstate/v1/state", R"({"action": "UNLOCK_PROTECTIVE_STOP"})");
  if (!answer) return answer.error();
  return text_of(*answer, "message");
}

Result<std::unique_ptr<UrPanel>> UrPanel::open(const ControllerVersion& version, const std::string& host,
                                               std::uint16_t port, Time timeout) {
  if (version.major < 10) {
    auto dashboard = UrDashboard::connect(host, port != 0 ? port : kDashboardPort, timeout);
    if (!dashboard) return dashboard.error();
    return std::unique_ptr<UrPanel>(new UrDashboard(*std::move(dashboard)));
  }
  if (version.major == 10 && version.minor < 11) {
    return Error{"PolyScope X has its Robot API from 10.11 on; this one answers no questions"};
  }
  auto api = std::make_unique<UrRobotApi>(host, port != 0 ? port : kRobotApiPort, timeout);
  if (const auto answer = api->ask("/openapi.json"); !answer) return answer.error();
  return std::unique_ptr<UrPanel>(std::move(api));
}

}  // namespace steadyhand
