#include "steadyhand/arms/ur/socket.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

namespace steadyhand {

Socket::~Socket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<Socket> Socket::connect(const std::string& host, std::uint16_t port, Time timeout) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int failed = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found); failed != 0) {
    return Error{fmt::format("'{}' is no host that can be found ({})", host, gai_strerror(failed))};
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
  std::string reason = "no address";
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    Socket socket(::socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (!socket) continue;
    int error = 0;
    if (::connect(socket.descriptor_, address->ai_addr, address->ai_addrlen) != 0) {
      error = errno;
      if (error == EINPROGRESS) {
        socklen_t size = sizeof(error);
        if (!socket.wait(POLLOUT, timeout)) {
          error = ETIMEDOUT;
        } else if (getsockopt(socket.descriptor_, SOL_SOCKET, SO_ERROR, &error, &size) != 0) {
          error = errno;
        }
      }
    }
    if (error != 0) {
      reason = std::strerror(error);
      continue;
    }
    const int on = 1;
    (void)setsockopt(socket.descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    return socket;
  }
  return Error{fmt::format("{}:{} does not answer ({})", host, port, reason)};
}

Result<std::pair<Socket, Socket>> Socket::pair() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) != 0) {
    return Error{fmt::format("no socket pair ({})", std::strerror(errno))};
  }
  return std::pair(Socket(ends[0]), Socket(ends[1]));
}

Socket::Outcome Socket::receive(std::span<std::uint8_t> into, std::size_t& received) {
  received = 0;
  if (descriptor_ < 0) return Outcome::kClosed;
  for (;;) {
    const ssize_t n = ::recv(descriptor_, into.data(), into.size(), 0);
    if (n > 0) {
      received = static_cast<std::size_t>(n);
      return Outcome::kDone;
    }
    if (n == 0) return into.empty() ? Outcome::kNothing : Outcome::kClosed;
    if (errno == EAGAIN || errno == EWOULDBLOCK) return Outcome::kNothing;
    if (errno != EINTR) return Outcome::kClosed;
  }
}

Socket::Outcome Socket::send(std::span<const std::uint8_t> bytes, std::size_t& sent) {
  sent = 0;
  if (descriptor_ < 0) return Outcome::kClosed;
  for (;;) {
    const ssize_t n = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n >= 0) {
      sent = static_cast<std::size_t>(n);
      return Outcome::kDone;
    }
    if (errno == EAGAIN || errno == EWOULDBLOCK) return Outcome::kNothing;
    if (errno != EINTR) return Outcome::kClosed;
  }
}

bool Socket::wait(short events, Time timeout) const {
  pollfd waiting{descriptor_, events, 0};
  timespec time{};
  time.tv_sec = timeout / std::chrono::seconds(1);
  time.tv_nsec = (timeout % std::chrono::seconds(1)).count();
  const int ready = ppoll(&waiting, 1, &time, nullptr);
  return ready > 0 || (ready < 0 && errno == EINTR);
}

bool Socket::wait_readable(Time timeout) const { return wait(POLLIN, std::max(Time(0), timeout)); }

bool Socket::send_all(std::string_view text, Time timeout) {
  auto bytes = std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  while (!bytes.empty()) {
    std::size_t sent = 0;
    const Outcome outcome = send(bytes, sent);
    if (outcome == Outcome::kClosed) return false;
    if (outcome == Outcome::kNothing && !wait(POLLOUT, timeout)) return false;
    bytes = bytes.subspan(sent);
  }
  return true;
}

}  // namespace steadyhand
