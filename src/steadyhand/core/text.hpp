#pragma once

#include <string>
#include <string_view>

namespace steadyhand {

/// Whether a terminal shows the text unchanged: no control characters, not empty.
inline bool is_name(std::string_view text) {
  unsigned char before = 0;
  for (const unsigned char c : text) {
    if (c < 0x20 || c == 0x7f || (before == 0xc2 && c < 0xa0)) return false;  // 0xc2: up to U+00BF, C1 below U+00A0
    before = c;
  }
  return !text.empty();
}

/// Whether a file that begins like this is a Git LFS pointer whose file was not pulled.
inline bool is_lfs_pointer(std::string_view begin) { return begin.starts_with("version https://git-lfs.github.com/"); }
/// Follows the file's name in a message.
inline constexpr std::string_view kLfsPointer =
    "is a Git LFS pointer, not the file itself: run `git lfs pull` in its repository";

/// The text in a form that is safe for a terminal: line ends, tabs and valid UTF-8 are unchanged. Control characters,
/// characters that change the direction of the text, and bytes that are not UTF-8 are written as in C: a backslash, x
/// and two digits for each byte.
std::string printable(std::string_view text);

}  // namespace steadyhand
