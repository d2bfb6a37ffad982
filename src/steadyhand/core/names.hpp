#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <optional>
#include <string_view>
#include <type_traits>

namespace steadyhand {

/// The name of an enumerator in files and messages.
template <typename Enum>
struct Name {
  Enum value;                  ///< the enumerator
  std::string_view name;       ///< in files and messages
  std::string_view what = {};  ///< for people who read the reference
};
/// @{ So that a table need not repeat the enumeration.
template <typename Enum>
Name(Enum, const char*) -> Name<Enum>;
template <typename Enum>
Name(Enum, const char*, const char*) -> Name<Enum>;
/// @}

/// The table of an enumeration's names.
template <typename Enum, std::size_t N>
struct Names {
  std::string_view type;              ///< name of the enumeration, in schemas and TypeScript
  std::array<Name<Enum>, N> entries;  ///< in the order of the enumerators
};

/// Makes the table that `constexpr auto names_of(Enum)` returns, next to the enumeration: all its enumerators in their
/// order, from 0 on, which is checked as it compiles.
template <typename Enum, std::size_t N>
consteval Names<Enum, N> named(std::string_view type, const Name<Enum> (&entries)[N]) {
  Names<Enum, N> names{type, std::to_array(entries)};
  for (std::size_t i = 0; i < N; ++i) {
    if (static_cast<std::size_t>(entries[i].value) != i) throw "names must have the order of the enumerators";
  }
  return names;
}

/// An enumeration that has such a table.
template <typename Enum>
concept Named = std::is_enum_v<Enum> && requires(Enum value) { names_of(value).entries; };

/// That table.
template <Named Enum>
inline constexpr auto kNamesOf = names_of(Enum{});

/// @returns static text; "unknown" for any other value
template <Named Enum>
constexpr std::string_view name_of(Enum value) {
  const auto i = static_cast<std::size_t>(value);
  return i < kNamesOf<Enum>.entries.size() ? kNamesOf<Enum>.entries[i].name : std::string_view("unknown");
}
/// The same.
template <Named Enum>
constexpr std::string_view to_string(Enum value) {
  return name_of(value);
}

/// The enumerator of a name, if there is one.
template <Named Enum>
constexpr std::optional<Enum> find_name(std::string_view name) {
  for (const Name<Enum>& entry : kNamesOf<Enum>.entries) {
    if (entry.name == name) return entry.value;
  }
  return std::nullopt;
}

}  // namespace steadyhand
