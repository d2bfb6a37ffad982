#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <optional>

namespace steadyhand {

/// Whose program is at the other end of a connection within this machine, as the kernel says; nothing: it is not here,
/// or the kernel does not tell (it has no inet_diag). Takes as long however many connections the machine has.
std::optional<unsigned> peer_user(const boost::asio::ip::tcp::socket& socket);

}  // namespace steadyhand
