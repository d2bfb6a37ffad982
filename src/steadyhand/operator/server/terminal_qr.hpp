#pragma once

#include <string>
#include <string_view>

namespace steadyhand {

/// `text` as a QR code of half blocks, two modules to a character, in black on white for any colours of the terminal.
/// Empty if it is too long for a code.
std::string terminal_qr(std::string_view text);

}  // namespace steadyhand
