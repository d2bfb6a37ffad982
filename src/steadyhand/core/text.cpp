#include "steadyhand/core/text.hpp"

#include <fmt/format.h>

#include <iterator>

namespace steadyhand {

namespace {

struct Character {
  std::size_t bytes = 1;
  bool shown = false;  ///< as it is
};

/// The first character of a text that is not empty.
Character first_of(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned head = byte(0);
  if (head < 0x80) return {1, (head >= 0x20 && head != 0x7f) || head == '\n' || head == '\t'};
  const std::size_t bytes = head >= 0xf0 ? 4 : head >= 0xe0 ? 3 : 2;
  constexpr unsigned kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // by length; a smaller code has a shorter form
  if (head < 0xc2 || head > 0xf4) return {};
  unsigned code = head & (0x7fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0u) != 0x80u) return {};
    code = code << 6u | (byte(i) & 0x3fu);
  }
  if (code < kLeast[bytes] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return {};
  const bool control = code < 0xa0, directs = (code >= 0x202a && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
  return {bytes, !control && !directs};
}

}  // namespace

std::string printable(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const Character next = first_of(text);
    for (const unsigned char byte : text.substr(0, next.bytes)) {
      next.shown ? shown.push_back(static_cast<char>(byte))
                 : (void)fmt::format_to(std::back_inserter(shown), "\\x{:02x}", byte);
    }
    text.remove_prefix(next.bytes);
  }
  return shown;
}

}  // namespace steadyhand
