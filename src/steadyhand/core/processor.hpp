#pragma once

#include <string_view>

namespace steadyhand {

/// What processor the code is for that computes: "x86-64-v4", "x86-64-v3", "x86-64-v2", "x86-64", "aarch64"; elsewhere
/// "generic".
std::string_view compiled_processor();

}  // namespace steadyhand
