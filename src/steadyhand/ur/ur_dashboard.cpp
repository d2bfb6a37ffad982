#include "steadyhand/ur/ur_dashboard.hpp"

#include <fmt/format.h>

#include <array>
#include <chrono>

namespace steadyhand {

namespace {
constexpr std::size_t kLongestLine = 1 << 16;
}

Result<UrDashboard> UrDashboard::connect(const std::string& host, std::uint16_t port, Time timeout) {
  auto socket = Socket::connect(host, port, timeout);
  if (!socket) return socket.error();
  UrDashboard dashboard(*std::move(socket), timeout);
  const auto greeting = dashboard.line();
  if (!greeting) return greeting.error();
  if (greeting->find("Dashboard") == std::string::npos) {
    return Error{fmt::format("{}:{} is no dashboard; it says '{}'", host, port, greeting->substr(0, 60))};
  }
  return dashboard;
}

Result<std::string> UrDashboard::ask(const std::string& command) {
  if (command.find('\n') != std::string::npos) return Error{"a dashboard command is one line"};
  if (!socket_.send_all(command + "\n", timeout_)) return Error{"the dashboard closed the connection"};
  return line();
}

std::vector<UrPanel::Line> UrDashboard::state() {
  std::vector<Line> lines;
  for (const char* question : {"robotmode", "safetystatus", "programState", "is in remote control"}) {
    const auto answer = ask(question);
    lines.push_back({question, answer ? *answer : answer.error().message});
  }
  return lines;
}

Result<std::string> UrDashboard::line() {
  const auto until = std::chrono::steady_clock::now() + timeout_;
  for (;;) {
    if (const std::size_t end = received_.find('\n'); end != std::string::npos) {
      std::string line = received_.substr(0, end);
      received_.erase(0, end + 1);
      if (!line.empty() && line.back() == '\r') line.pop_back();
      return line;
    }
    std::array<std::uint8_t, 1024> bytes;
    std::size_t n = 0;
    const Socket::Outcome outcome = socket_.receive(bytes, n);
    received_.append(reinterpret_cast<const char*>(bytes.data()), n);
    if (outcome == Socket::Outcome::kClosed) return Error{"the dashboard closed the connection"};
    if (received_.size() > kLongestLine) return Error{"the dashboard's answer has no end"};
    const Time left = until - std::chrono::steady_clock::now();
    if (left <= Time(0)) {
      socket_ = Socket();  // an answer that comes late would be taken for that to the next question
      return Error{"the dashboard does not answer"};
    }
    if (outcome == Socket::Outcome::kNothing) (void)socket_.wait_readable(left);
  }
}

}  // namespace steadyhand
