#pragma once

#include <string>

#include "arm/socket.hpp"

namespace steadyhand {

/// The dashboard server of a Universal Robots controller (TCP 29999; e-Series and CB3, not PolyScope X): a line of text
/// each way. For people's questions, not for control.
class UrDashboard {
 public:
  static Result<UrDashboard> connect(const std::string& host, std::uint16_t port, Time patience);
  /// Sends a command of the dashboard's manual and returns the answer without its end of line.
  Result<std::string> ask(const std::string& command);

 private:
  UrDashboard(Socket socket, Time patience) : socket_(std::move(socket)), patience_(patience) {}
  Result<std::string> line();
  Socket socket_;
  Time patience_;
  std::string received_;
};

}  // namespace steadyhand
