#pragma once

#include <memory>
#include <string>
#include <vector>

#include "steadyhand/arms/ur/rtde_client.hpp"
#include "steadyhand/arms/ur/text_lines.hpp"

namespace steadyhand {

/// Actions of a person at the pendant, over the network: the dashboard server (TCP 29999) of e-Series and CB3, or the
/// Robot API (HTTP) of PolyScope X 10.11 and newer. Not for control.
class UrPanel {
 public:
  virtual ~UrPanel() = default;
  struct Line {
    std::string question, answer;
  };
  /// Modes, program and remote control, as far as this software reports them.
  virtual std::vector<Line> state() = 0;
  /// The controller's answer; RTDE reports whether the stop is cleared.
  virtual Result<std::string> unlock_protective_stop() = 0;

  static constexpr std::uint16_t kDashboardPort = 29999, kRobotApiPort = 80;
  /// @param port 0: the usual one of that software
  static Result<std::unique_ptr<UrPanel>> open(const ControllerVersion& version, const std::string& host,
                                               std::uint16_t port, Time timeout);
};

/// A line of text each way; the dashboard server.
class UrDashboard final : public UrPanel {
 public:
  static Result<UrDashboard> connect(const std::string& host, std::uint16_t port, Time timeout);
  /// Sends a command of the dashboard's manual and returns the answer without its end of line.
  Result<std::string> ask(const std::string& command) { return lines_.ask(command); }
  std::vector<Line> state() override;
  Result<std::string> unlock_protective_stop() override { return ask("unlock protective stop"); }

 private:
  explicit UrDashboard(TextLines lines) : lines_(std::move(lines)) {}
  TextLines lines_;
};

/// HTTP requests with a JSON object as the answer, each over a new connection.
class UrRobotApi final : public UrPanel {
 public:
  UrRobotApi(std::string host, std::uint16_t port, Time timeout)
      : host_(std::move(host)), port_(port), timeout_(timeout) {}
  /// @param body of a PUT; empty: a GET @return the answer's body; what the controller does not know is an error
  Result<std::string> ask(const std::string& path, const std::string& body = {});
  std::vector<Line> state() override;
  Result<std::string> unlock_protective_stop() override;

 private:
  std::string host_;
  std::uint16_t port_;
  Time timeout_;
};

}  // namespace steadyhand
