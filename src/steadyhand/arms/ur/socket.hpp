#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// A stream socket that never blocks. Only connecting and functions that return text allocate.
class Socket {
 public:
  Socket() = default;
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  ~Socket();

  /// Over TCP, without Nagle's delay. Fails with the address and the system's reason, at the latest after `timeout`.
  static Result<Socket> connect(const std::string& host, std::uint16_t port, Time timeout);
  /// Two ends of a connection inside this process.
  static Result<std::pair<Socket, Socket>> pair();

  explicit operator bool() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }

  enum class Outcome { kDone, kNothing, kClosed };
  /// Bytes that are there now, at most as many as fit. kNothing: none yet. kClosed: the other end has gone.
  Outcome receive(std::span<std::uint8_t> into, std::size_t& received);
  /// As many as the system takes; the rest is the caller's.
  Outcome send(std::span<const std::uint8_t> bytes, std::size_t& sent);
  /// Until there is something to receive (or the other end has gone), at most `timeout`. False: nothing came.
  bool wait_readable(Time timeout) const;
  /// Sends all, within `timeout`. For set-up only.
  bool send_all(std::string_view text, Time timeout);

 private:
  bool wait(short events, Time timeout) const;
  int descriptor_ = -1;
};

}  // namespace steadyhand
