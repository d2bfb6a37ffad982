// WebSocket frames: the first byte says in what pieces they come, which must make no difference.
#include "serve/frames.hpp"

#include "fuzz/fuzz.hpp"

namespace steadyhand {
namespace {

constexpr std::size_t kLongest = 2048;

/// Everything that the bytes came to, in words.
std::string read(std::string_view bytes, std::size_t piece) {
  using Kind = FrameEvent::Kind;
  FrameReader reader(kLongest);
  std::string said;
  while (!bytes.empty()) {
    std::string_view part = bytes.substr(0, piece);
    bytes.remove_prefix(part.size());
    while (!part.empty()) {
      const std::size_t before = part.size();
      const FrameEvent event = reader.next(part);
      fuzz::require(part.size() < before || event.kind == Kind::kBroken, "bytes are taken");
      fuzz::require(event.payload.size() <= kLongest, "no message longer than allowed");
      if (event.kind == Kind::kNone) continue;
      said += std::to_string(static_cast<int>(event.kind)) + ":" + std::string(event.payload) + ";";
      if (event.kind == Kind::kBroken || event.kind == Kind::kClose) return said;
    }
  }
  return said;
}

}  // namespace

FUZZ(frames) {
  if (input.empty()) return;
  const std::size_t piece = 1 + static_cast<std::uint8_t>(input.front());
  input.remove_prefix(1);
  fuzz::require(read(input, piece) == read(input, input.size() + 1), "the same in whatever pieces");
}

}  // namespace steadyhand
