#include "steadyhand/arms/ur/ur_primary.hpp"

#include <chrono>
#include <cmath>
#include <cstring>

#include "steadyhand/arms/ur/rtde_packet.hpp"

namespace steadyhand {

namespace {

constexpr std::size_t kHeader = 5;         // bytes: size of all, type
constexpr std::size_t kChecksums = 6 * 4;  // bytes that kinematics begin with

void read_state(RtdeReader reader, UrMessage& message) {
  while (reader.left() > kHeader) {
    const auto size = reader.take<std::uint32_t>();
    const auto type = static_cast<UrStatePart>(reader.take<std::uint8_t>());
    if (size < kHeader || size - kHeader > reader.left()) return;
    const std::string_view part = reader.text(size - kHeader);
    if (type != UrStatePart::kKinematics) continue;
    RtdeReader inner({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()});
    (void)inner.text(kChecksums);
    UrKinematics& k = message.kinematics;
    bool finite = true;
    for (auto* values : {&k.theta, &k.a, &k.d, &k.alpha}) {
      for (double& value : *values) {
        value = inner.take<double>();
        finite = finite && std::isfinite(value);
      }
    }
    if (inner.ok() && finite) message.kind = UrMessage::Kind::kKinematics;
  }
}

void read_message(RtdeReader reader, UrMessage& message) {
  (void)reader.take<std::uint64_t>();  // time
  (void)reader.take<std::uint8_t>();   // source
  const auto type = static_cast<UrMessageType>(reader.take<std::uint8_t>());
  if (type == UrMessageType::kError) {
    message.code = reader.take<std::int32_t>();
    message.argument = reader.take<std::int32_t>();
    message.level = reader.take<std::int32_t>();
    (void)reader.take<std::uint32_t>();  // type of the data that follow
    (void)reader.take<std::uint32_t>();
    message.text = reader.rest();
    if (reader.ok()) message.kind = UrMessage::Kind::kError;
  } else if (type == UrMessageType::kException) {
    message.line = reader.take<std::int32_t>();
    (void)reader.take<std::int32_t>();  // column
    message.text = reader.rest();
    if (reader.ok()) message.kind = UrMessage::Kind::kException;
  }
}

}  // namespace

Socket::Outcome UrPrimary::fill() {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  std::size_t received = 0;
  const Socket::Outcome outcome = socket_.receive(std::span(buffer_).subspan(end_), received);
  end_ += received;
  return broken_ ? Socket::Outcome::kClosed : outcome;
}

bool UrPrimary::next(UrMessage& message) {
  if (broken_ || end_ - begin_ < kHeader) return false;
  RtdeReader reader(std::span<const std::uint8_t>(buffer_).subspan(begin_, end_ - begin_));
  const std::size_t size = reader.take<std::uint32_t>();
  if (size < kHeader || size > kLargest) {
    broken_ = true;
    return false;
  }
  if (end_ - begin_ < size) return false;
  const auto type = static_cast<UrPackage>(reader.take<std::uint8_t>());
  const RtdeReader inside(std::span<const std::uint8_t>(buffer_).subspan(begin_ + kHeader, size - kHeader));
  begin_ += size;
  message = {};
  if (type == UrPackage::kState) read_state(inside, message);
  if (type == UrPackage::kMessage) read_message(inside, message);
  return true;
}

std::optional<UrKinematics> read_kinematics(UrPrimary& primary, Time timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    const Socket::Outcome outcome = primary.fill();
    for (UrMessage message; primary.next(message);) {
      if (message.kind == UrMessage::Kind::kKinematics) return message.kinematics;
    }
    const Time left = until - std::chrono::steady_clock::now();
    if (outcome == Socket::Outcome::kClosed || left <= Time(0)) return std::nullopt;
    if (outcome == Socket::Outcome::kNothing) (void)primary.wait(left);
  }
}

}  // namespace steadyhand
