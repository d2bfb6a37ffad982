#include "steadyhand/operator/server/terminal_qr.hpp"

#include <qrencode.h>

#include <memory>

namespace steadyhand {

std::string terminal_qr(std::string_view text) {
  const std::string copy(text);
  const std::unique_ptr<QRcode, decltype(&QRcode_free)> code(QRcode_encodeString8bit(copy.c_str(), 0, QR_ECLEVEL_L),
                                                             QRcode_free);
  if (!code) return {};
  constexpr int kQuiet = 2;  // modules of margin; readers manage with less than the standard's four
  const auto dark = [&](int row, int column) {
    if (row < 0 || column < 0 || row >= code->width || column >= code->width) return false;
    return (code->data[row * code->width + column] & 1) != 0;
  };
  std::string picture;
  for (int row = -kQuiet; row < code->width + kQuiet; row += 2) {
    picture += "\033[38;2;0;0;0;48;2;255;255;255m";
    for (int column = -kQuiet; column < code->width + kQuiet; ++column) {
      const bool upper = dark(row, column), lower = dark(row + 1, column);
      picture += upper ? (lower ? "█" : "▀") : (lower ? "▄" : " ");
    }
    picture += "\033[0m\n";
  }
  return picture;
}

}  // namespace steadyhand
