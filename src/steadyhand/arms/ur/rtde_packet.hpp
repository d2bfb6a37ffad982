#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

/// Packets of the Real-Time Data Exchange protocol of Universal Robots (TCP 30004), after the manufacturer's RTDE
/// guide: 2 bytes of size (all of the packet), 1 byte of type, payload; everything big-endian.
namespace steadyhand {

enum class RtdeType : std::uint8_t {
  kRequestVersion = 'V',
  kControllerVersion = 'v',
  kData = 'U',
  kSetupOutputs = 'O',
  kSetupInputs = 'I',
  kStart = 'S',
  kPause = 'P',
};

struct RtdePacket {
  RtdeType type{};                        ///< may be none of the above: skip those
  std::span<const std::uint8_t> payload;  ///< valid until the next RtdeFramer::space()
};

inline constexpr std::size_t kRtdeHeader = 3, kRtdeLargest = 65535;  // bytes

/// Cuts a byte stream into packets. All memory from the constructor.
class RtdeFramer {
 public:
  RtdeFramer() : buffer_(2 * kRtdeLargest) {}
  /// Where the next bytes of the stream go; at least one packet's room.
  std::span<std::uint8_t> space();
  /// Marks `bytes` at the beginning of space() as filled.
  void filled(std::size_t bytes) { end_ += bytes; }
  /// The next whole packet; false if there is none yet, or ever (broken()).
  bool next(RtdePacket& packet);
  /// A size was less than that of a header: there is no telling where the next packet begins.
  bool broken() const { return broken_; }

 private:
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0, end_ = 0;
  bool broken_ = false;
};

template <typename T>
T big_endian(T value) {
  static_assert(std::endian::native == std::endian::little || std::endian::native == std::endian::big);
  if constexpr (std::endian::native == std::endian::little) {
    auto* bytes = reinterpret_cast<std::uint8_t*>(&value);
    std::reverse(bytes, bytes + sizeof(T));
  }
  return value;
}

/// Reads numbers and text from a payload. Reads beyond its end give zero and are noted.
class RtdeReader {
 public:
  explicit RtdeReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  template <typename T>
  T take() {
    T value{};
    if (bytes_.size() < sizeof(T)) {
      ok_ = false;
      bytes_ = {};
      return value;
    }
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_ = bytes_.subspan(sizeof(T));
    return big_endian(value);
  }
  std::string_view text(std::size_t size) {
    if (size > bytes_.size()) ok_ = false;
    size = std::min(size, bytes_.size());
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()), size);
    bytes_ = bytes_.subspan(size);
    return text;
  }
  std::string_view rest() { return text(bytes_.size()); }
  std::size_t left() const { return bytes_.size(); }
  /// Nothing was asked for beyond the end.
  bool ok() const { return ok_; }

 private:
  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

/// Builds one packet in a buffer of `kRoom` bytes; data that does not fit is omitted and noted.
class RtdeWriter {
 public:
  explicit RtdeWriter(RtdeType type) : size_(kRtdeHeader) { bytes_[2] = static_cast<std::uint8_t>(type); }
  template <typename T>
  void put(T value) {
    const T big = big_endian(value);
    put_bytes(&big, sizeof(T));
  }
  void text(std::string_view text) { put_bytes(text.data(), text.size()); }
  /// The packet with its size filled in.
  std::span<const std::uint8_t> packet() {
    const auto size = big_endian(static_cast<std::uint16_t>(size_));
    std::memcpy(bytes_, &size, sizeof(size));
    return {bytes_, size_};
  }
  bool ok() const { return ok_; }

 private:
  void put_bytes(const void* data, std::size_t size) {
    if (size > kRoom - size_) {
      ok_ = false;
      return;
    }
    if (size > 0) std::memcpy(bytes_ + size_, data, size);
    size_ += size;
  }
  static constexpr std::size_t kRoom = 4096;  ///< recipes are limited to 2048 bytes by the controller
  std::uint8_t bytes_[kRoom];
  std::size_t size_;
  bool ok_ = true;
};

}  // namespace steadyhand
