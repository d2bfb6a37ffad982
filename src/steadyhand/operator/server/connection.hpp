#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "steadyhand/operator/protocol/hub.hpp"
#include "steadyhand/operator/server/site.hpp"

namespace boost::asio {
class thread_pool;
namespace ssl {
class context;
}
}  // namespace boost::asio

namespace steadyhand {

/// What all connections share; belongs to the server's thread.
struct ConnectionsShared {
  Hub* hub = nullptr;
  const Site* site = nullptr;
  std::function<Time()> now;
  bool accept_missing_origin = true;
  Time timeout{0};      ///< for a peer that sends nothing or reads nothing
  bool ending = false;  ///< the program ends: clients sent away now did nothing wrong

  /// Those that ask for files, or that have not asked yet; clients of the hub are not among them.
  struct Visitor {
    Address address;
    Time since{0};
    std::function<void()> cut;
    bool reads = false;  ///< a recording: then it keeps its place
  };
  std::size_t max_visitors = 3 * 96;  ///< files are small and few; more than may read recordings at once
  std::map<std::uint64_t, Visitor> visitors;
  std::uint64_t last_visitor = 0;

  using Answer = std::function<void(Result<FreshPage>)>;
  /// Asks the session for a page, with a number for the answer; empty: there are no pages. The answer arrives at
  /// `waiting`, where the connections that asked are kept. No other object may hold them, because they must end with
  /// the server.
  std::function<void(const std::string& path, std::uint64_t number)> fetch;
  std::map<std::uint64_t, Answer> waiting;
  std::uint64_t last_fetch = 0;
  /// Whether one more recording may be read: bounded in all and for each address, except for the client in control.
  bool has_place(const Address& address, bool in_control) const;
  boost::asio::thread_pool* disk = nullptr;  ///< reads files and closes them, and may wait for it; nullptr: the end
};

/// A source of connections.
struct Listener {
  /// Host names that it answers. For plain HTTP only those whose address nothing on the network can change.
  std::vector<std::string> hosts;
  boost::asio::ssl::context* tls = nullptr;  ///< nullptr: plain HTTP
};

/// A connection that serves the page's files and, at /live, becomes a WebSocket. Keeps itself alive until it ends; ends
/// itself when the peer times out. The listener must outlive it.
void serve_connection(boost::asio::ip::tcp::socket socket, ConnectionsShared& shared, const Listener& listener);

}  // namespace steadyhand
