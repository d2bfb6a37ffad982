#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <optional>

namespace steadyhand {

/// The user whose program is at the other end of a connection within this machine, from the kernel. Nothing: it is not
/// here, or the kernel has no inet_diag. The time does not depend on how many connections the machine has.
std::optional<unsigned> peer_user(const boost::asio::ip::tcp::socket& socket);

}  // namespace steadyhand
