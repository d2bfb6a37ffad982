#include "serve/peer_user.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

namespace steadyhand {
namespace {

using boost::asio::ip::tcp;

/// As /proc/net/tcp writes it: the address's bytes as one number of this machine.
std::string name_of(const tcp::endpoint& endpoint) {
  const auto bytes = endpoint.address().to_v4().to_bytes();
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data(), sizeof number);
  return fmt::format("{:08X}:{:04X}", number, endpoint.port());
}

}  // namespace

std::optional<unsigned> peer_user(const tcp::socket& socket) {
  boost::system::error_code gone;
  const tcp::endpoint here = socket.local_endpoint(gone), there = socket.remote_endpoint(gone);
  if (gone || !here.address().is_v4() || !there.address().is_v4() || !there.address().is_loopback()) return {};
  const std::string from = name_of(there), to = name_of(here);
  std::ifstream table("/proc/net/tcp");
  for (std::string line; std::getline(table, line);) {
    std::istringstream words(line);
    std::string number, local, remote, state, queues, timer, retransmits;
    unsigned user = 0;
    if (!(words >> number >> local >> remote >> state >> queues >> timer >> retransmits >> user)) continue;
    if (local == from && remote == to && state == "01") return user;  // established
  }
  return {};
}

}  // namespace steadyhand
