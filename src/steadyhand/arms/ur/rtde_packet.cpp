#include "steadyhand/arms/ur/rtde_packet.hpp"

namespace steadyhand {

std::span<std::uint8_t> RtdeFramer::space() {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  return std::span(buffer_).subspan(end_);
}

bool RtdeFramer::next(RtdePacket& packet) {
  if (broken_ || end_ - begin_ < kRtdeHeader) return false;
  RtdeReader reader(std::span<const std::uint8_t>(buffer_).subspan(begin_, kRtdeHeader));
  const std::size_t size = reader.take<std::uint16_t>();
  if (size < kRtdeHeader) {
    broken_ = true;
    return false;
  }
  if (end_ - begin_ < size) return false;
  packet.type = static_cast<RtdeType>(reader.take<std::uint8_t>());
  packet.payload = std::span<const std::uint8_t>(buffer_).subspan(begin_ + kRtdeHeader, size - kRtdeHeader);
  begin_ += size;
  return true;
}

}  // namespace steadyhand
