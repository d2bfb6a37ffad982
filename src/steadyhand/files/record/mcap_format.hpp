#pragma once

#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

/// The byte layout of MCAP version 0 (mcap.dev/spec): little-endian numbers; strings, maps and arrays behind the number
/// of their bytes; a record is an opcode, the number of bytes that follow, and those bytes.
namespace steadyhand::mcap {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Appends fields to a byte string.
class Bytes {
 public:
  template <typename Number>
  void number(Number value) {
    content_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  void raw(std::string_view bytes) { content_.append(bytes); }
  /// `Length` bytes of length, then the bytes themselves.
  template <typename Length = std::uint32_t>
  void sized(std::string_view bytes) {
    number(static_cast<Length>(bytes.size()));
    raw(bytes);
  }
  void map(const std::map<std::string, std::string>& entries) {
    Bytes content;
    for (const auto& [key, value] : entries) {
      content.sized(key);
      content.sized(value);
    }
    sized(content.view());
  }
  void record(Opcode opcode, std::string_view content) {
    number(opcode);
    sized<std::uint64_t>(content);
  }

  std::string_view view() const { return content_; }
  std::size_t size() const { return content_.size(); }
  bool empty() const { return content_.empty(); }
  void clear() { content_.clear(); }

 private:
  std::string content_;
};

}  // namespace steadyhand::mcap
