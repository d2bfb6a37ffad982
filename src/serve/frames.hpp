#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// WebSocket as RFC 6455 says it, a server's half without extensions: bytes to frames and back; knows no sockets.
namespace steadyhand {

/// Of a close frame.
enum class CloseCode : std::uint16_t { kNormal = 1000, kProtocol = 1002, kPolicy = 1008, kTooBig = 1009 };

enum class Opcode : std::uint8_t { kContinuation = 0, kText = 1, kBinary = 2, kClose = 8, kPing = 9, kPong = 10 };

/// What the bytes of a client came to.
struct FrameEvent {
  enum class Kind {
    kNone,     ///< more bytes are needed
    kMessage,  ///< whole, in `payload`
    kPart,     ///< of a message that goes on
    kPing,     ///< to be answered with `payload`
    kPong,
    kClose,   ///< the client's farewell, to be answered; nothing may follow
    kBroken,  ///< it must be closed, with `code`; nothing may follow
  };
  Kind kind = Kind::kNone;
  std::string_view payload;  ///< until the next call
  CloseCode code = CloseCode::kNormal;
};

/// Any bytes at all, in any pieces. Keeps at most a message, and never allocates once it has had the longest.
class FrameReader {
 public:
  explicit FrameReader(std::size_t longest_message) : longest_(longest_message) {}

  /// Takes bytes from the front of `bytes`, up to the end of one frame.
  FrameEvent next(std::string_view& bytes);

 private:
  static constexpr std::size_t kMaxHead = 14;      // bytes
  static constexpr std::size_t kMaxControl = 125;  // bytes of a control frame's payload

  std::size_t head_size() const;
  /// The head is there: kBroken if it may not be.
  FrameEvent begin_frame();
  FrameEvent end_frame();
  bool is_control() const { return (head_[0] & 0x08) != 0; }

  std::size_t longest_;
  std::array<unsigned char, kMaxHead> head_{};
  std::size_t head_bytes_ = 0;
  bool in_payload_ = false, in_message_ = false;
  std::size_t left_ = 0, masked_ = 0;  ///< bytes of the payload still to come, and those that came
  std::string message_, control_;
};

/// What a server puts before `size` bytes of payload.
void append_frame_head(std::string& out, Opcode opcode, std::size_t size);
/// Sec-WebSocket-Accept for a client's Sec-WebSocket-Key.
std::string accept_key(std::string_view key);

}  // namespace steadyhand
