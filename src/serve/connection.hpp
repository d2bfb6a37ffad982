#pragma once

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "serve/hub.hpp"
#include "serve/site.hpp"

namespace steadyhand {

/// What all connections share; belongs to the server's thread.
struct Desk {
  Hub* hub = nullptr;
  const Site* site = nullptr;
  std::function<Time()> now;
  std::vector<std::string> hosts;  ///< names under which this machine may be asked
  bool accept_missing_origin = true;
  int max_clients = 96;
  int connections = 0;  ///< open now, of any kind

  using Answer = std::function<void(Result<FreshPage>)>;
  /// Asks the session for a page, by a number of its own; empty: there are none to be had. Its answer arrives at
  /// `waiting`, where the connections that asked are kept: nobody else may hold them, for they must end with the
  /// server.
  std::function<void(const std::string& path, std::uint64_t number)> fetch;
  std::map<std::uint64_t, Answer> waiting;
  std::uint64_t last_fetch = 0;
};

/// A connection that serves the page's files and, at /live, becomes a WebSocket. Keeps itself alive until it ends; ends
/// itself when the peer falls silent. tls: nullptr for plain HTTP.
void serve_connection(boost::asio::ip::tcp::socket socket, Desk& desk, boost::asio::ssl::context* tls);

}  // namespace steadyhand
