#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <string_view>

namespace boost::asio::ssl {
class context;
}

namespace steadyhand {

/// The bytes of one connection, over TLS or not: all that is above is compiled once. One operation of each kind at a
/// time; what it is given must live until it is done, and so must the stream.
class Stream {
 public:
  /// How many bytes; 0: the connection has ended.
  using Done = std::function<void(std::size_t bytes)>;

  virtual ~Stream() = default;
  virtual bool encrypted() const = 0;
  /// Before anything else; `bytes` means nothing but that it went well.
  virtual void handshake(Done done) = 0;
  /// What there is, up to `room` bytes.
  virtual void read(char* to, std::size_t room, Done done) = 0;
  /// Both, one after the other.
  virtual void write(std::string_view first, std::string_view second, Done done) = 0;
  /// No more will be written; what was is delivered.
  virtual void finish() = 0;
  /// At once: what is under way ends.
  virtual void cut() = 0;
  /// As TCP has it.
  virtual boost::asio::ip::tcp::socket& socket() = 0;
};

/// @param tls nullptr: without
std::unique_ptr<Stream> make_stream(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context* tls);

}  // namespace steadyhand
