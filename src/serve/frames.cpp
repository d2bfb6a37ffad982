#include "serve/frames.hpp"

#include <openssl/evp.h>
#include <openssl/sha.h>

#include <algorithm>

namespace steadyhand {

using Kind = FrameEvent::Kind;

/// As far as it is known from the bytes that are there.
std::size_t FrameReader::head_size() const {
  if (head_bytes_ < 2) return 2;
  const unsigned length = head_[1] & 0x7fu;
  return 2 + (length == 126 ? 2 : length == 127 ? 8 : 0) + ((head_[1] & 0x80) != 0 ? 4 : 0);
}

FrameEvent FrameReader::next(std::string_view& bytes) {
  while (!in_payload_ && head_bytes_ < head_size()) {
    if (bytes.empty()) return {};
    head_[head_bytes_++] = static_cast<unsigned char>(bytes.front());
    bytes.remove_prefix(1);
    if (head_bytes_ < head_size()) continue;
    if (const FrameEvent broken = begin_frame(); broken.kind != Kind::kNone) return broken;
  }
  const std::size_t taken = std::min(left_, bytes.size());
  std::string& to = is_control() ? control_ : message_;
  const unsigned char* mask = head_.data() + head_size() - 4;  // every frame has one, or it is broken
  for (std::size_t i = 0; i < taken; ++i) {
    to.push_back(static_cast<char>(static_cast<unsigned char>(bytes[i]) ^ mask[masked_++ % 4]));
  }
  bytes.remove_prefix(taken);
  left_ -= taken;
  return left_ == 0 ? end_frame() : FrameEvent{};
}

FrameEvent FrameReader::begin_frame() {
  const auto broken = [](CloseCode code) { return FrameEvent{Kind::kBroken, {}, code}; };
  const bool final = (head_[0] & 0x80) != 0, reserved = (head_[0] & 0x70) != 0, masked = (head_[1] & 0x80) != 0;
  if (reserved || !masked) return broken(CloseCode::kProtocol);
  std::uint64_t length = head_[1] & 0x7fu;
  if (length >= 126) {
    const std::size_t bytes = length == 126 ? 2 : 8;
    length = 0;
    for (std::size_t i = 0; i < bytes; ++i) length = length << 8 | head_[2 + i];
  }
  const auto opcode = static_cast<Opcode>(head_[0] & 0x0f);
  switch (opcode) {
    case Opcode::kText:
    case Opcode::kBinary:
      if (in_message_) return broken(CloseCode::kProtocol);
      message_.clear();
      break;
    case Opcode::kContinuation:
      if (!in_message_) return broken(CloseCode::kProtocol);
      break;
    case Opcode::kClose:
    case Opcode::kPing:
    case Opcode::kPong:
      if (!final || length > kMaxControl) return broken(CloseCode::kProtocol);
      control_.clear();
      break;
    default:
      return broken(CloseCode::kProtocol);
  }
  if (!is_control()) {
    if (length > longest_ - message_.size()) return broken(CloseCode::kTooBig);
    in_message_ = !final;
  }
  left_ = static_cast<std::size_t>(length);
  masked_ = 0;
  in_payload_ = true;
  return {};
}

FrameEvent FrameReader::end_frame() {
  in_payload_ = false;
  head_bytes_ = 0;
  switch (static_cast<Opcode>(head_[0] & 0x0f)) {
    case Opcode::kClose:
      return {Kind::kClose, control_, CloseCode::kNormal};
    case Opcode::kPing:
      return {Kind::kPing, control_, {}};
    case Opcode::kPong:
      return {Kind::kPong, control_, {}};
    default:
      return in_message_ ? FrameEvent{Kind::kPart, {}, {}} : FrameEvent{Kind::kMessage, message_, {}};
  }
}

void append_frame_head(std::string& out, Opcode opcode, std::size_t size) {
  out.push_back(static_cast<char>(0x80u | static_cast<unsigned>(opcode)));
  const int bytes = size < 126 ? 0 : size <= 0xffff ? 2 : 8;
  out.push_back(static_cast<char>(bytes == 0 ? size : bytes == 2 ? 126 : 127));
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<char>(size >> (8 * i)));
}

std::string accept_key(std::string_view key) {
  const std::string text = std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";  // of the RFC
  std::array<unsigned char, SHA_DIGEST_LENGTH> digest{};
  SHA1(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  std::array<unsigned char, 4 * ((SHA_DIGEST_LENGTH + 2) / 3) + 1> base64{};
  const int size = EVP_EncodeBlock(base64.data(), digest.data(), SHA_DIGEST_LENGTH);
  return {reinterpret_cast<const char*>(base64.data()), static_cast<std::size_t>(size)};
}

}  // namespace steadyhand
