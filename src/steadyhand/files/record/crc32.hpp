#pragma once

#include <cstdint>
#include <string_view>

namespace steadyhand {

/// CRC-32 as zlib computes it (polynomial 0xEDB88320, reflected). Pass the last value to go on: crc32(b, crc32(a)) is
/// that of a followed by b.
std::uint32_t crc32(std::string_view bytes, std::uint32_t crc = 0);

}  // namespace steadyhand
