#pragma once

#include <cstddef>
#include <string_view>
#include <utility>

namespace steadyhand {

/// The text of a value in a table; `other` of one that is not there.
template <typename Value, std::size_t N>
constexpr std::string_view text_of(const std::pair<Value, std::string_view> (&table)[N], Value value,
                                   std::string_view other = "unknown") {
  for (const auto& [known, text] : table) {
    if (known == value) return text;
  }
  return other;
}

}  // namespace steadyhand
