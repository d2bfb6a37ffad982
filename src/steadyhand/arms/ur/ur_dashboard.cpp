#include "steadyhand/arms/ur/ur_dashboard.hpp"

#include <fmt/format.h>

namespace steadyhand {

Result<UrDashboard> UrDashboard::connect(const std::string& host, std::uint16_t port, Time timeout) {
  auto socket = Socket::connect(host, port, timeout);
  if (!socket) return socket.error();
  UrDashboard dashboard({*std::move(socket), "the dashboard", timeout});
  const auto greeting = dashboard.lines_.line();
  if (!greeting) return greeting.error();
  if (greeting->find("Dashboard") == std::string::npos) {
    return Error{fmt::format("{}:{} is not a dashboard; its answer is '{}'", host, port, greeting->substr(0, 60))};
  }
  return dashboard;
}

std::vector<UrPanel::Line> UrDashboard::state() {
  std::vector<Line> lines;
  for (const char* question : {"robotmode", "safetystatus", "programState", "is in remote control"}) {
    const auto answer = ask(question);
    lines.push_back({question, answer ? *answer : answer.error().message});
  }
  return lines;
}

}  // namespace steadyhand
