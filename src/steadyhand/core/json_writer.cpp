#include "steadyhand/core/json_writer.hpp"

#include <fmt/format.h>

#include <cmath>

namespace steadyhand {

namespace {

/// Number of bytes of the UTF-8 character at the start of `text`. If there is none, returns 0 and sets `bad` to the
/// number of invalid bytes (those before the first that cannot follow, at least 1).
std::size_t character(std::string_view text, std::size_t& bad) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  bad = 1;
  if (first < 0x80) return 1;
  const std::size_t size = first >= 0xc2 && first <= 0xdf   ? 2
                           : first >= 0xe0 && first <= 0xef ? 3
                           : first >= 0xf0 && first <= 0xf4 ? 4
                                                            : 0;
  if (size == 0) return 0;
  for (std::size_t i = 1; i < size; ++i, ++bad) {
    // Neither overlong, nor a surrogate, nor beyond U+10FFFF.
    const unsigned char low = i > 1 ? 0x80 : first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
    const unsigned char high = i > 1 ? 0xbf : first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
    if (i >= text.size() || byte(i) < low || byte(i) > high) return 0;
  }
  return size;
}

}  // namespace

void JsonWriter::key(std::string_view name) {
  separate();
  quoted(name);
  out_->push_back(':');
  comma_ = false;
}

void JsonWriter::raw(std::string_view json) {
  separate();
  *out_ += json;
}

void JsonWriter::value(std::string_view text) {
  separate();
  quoted(text);
}

void JsonWriter::number_value(double number) {
  if (!std::isfinite(number)) return raw("null");
  separate();
  if (digits_ == Digits::kSix) {
    fmt::format_to(std::back_inserter(*out_), "{:.6g}", number);
  } else {
    fmt::format_to(std::back_inserter(*out_), "{}", number);
  }
}

void JsonWriter::value(double number, const char* format) {
  if (!std::isfinite(number)) return raw("null");
  separate();
  fmt::format_to(std::back_inserter(*out_), fmt::runtime(format), number);
}

void JsonWriter::quoted(std::string_view text) {
  out_->push_back('"');
  while (!text.empty()) {
    std::size_t bad = 0;
    const std::size_t size = character(text, bad);
    const char c = text[0];
    const char* const escaped = c == '"'    ? "\\\""
                                : c == '\\' ? "\\\\"
                                : c == '\b' ? "\\b"
                                : c == '\f' ? "\\f"
                                : c == '\n' ? "\\n"
                                : c == '\r' ? "\\r"
                                : c == '\t' ? "\\t"
                                            : nullptr;
    if (size == 0) {
      *out_ += "\xef\xbf\xbd";
    } else if (escaped != nullptr) {
      *out_ += escaped;
    } else if (size == 1 && static_cast<unsigned char>(c) < 0x20) {
      fmt::format_to(std::back_inserter(*out_), "\\u{:04x}", static_cast<unsigned>(c));
    } else {
      *out_ += text.substr(0, size);
    }
    text.remove_prefix(size == 0 ? bad : size);
  }
  out_->push_back('"');
}

}  // namespace steadyhand
