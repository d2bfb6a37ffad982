#pragma once

#include <string_view>

namespace steadyhand {

/// The processor that the numerical code is compiled for: "x86-64-v4", "x86-64-v3", "x86-64-v2", "x86-64", "aarch64";
/// for others "generic".
std::string_view compiled_processor();

}  // namespace steadyhand
