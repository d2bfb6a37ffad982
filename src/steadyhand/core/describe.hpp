#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "steadyhand/core/json_writer.hpp"
#include "steadyhand/core/math.hpp"
#include "steadyhand/core/names.hpp"
#include "steadyhand/core/time.hpp"

/// A message is described once, by a function next to its struct:
///
///     template <typename V>
///     void describe(V& v, Timing& t) {
///       v.type("Timing", "Percentiles of the last seconds.");
///       v.add("p50", "us", "median", t.p50, at_least(0.0).or_null());
///     }
///
/// JsonOut writes it, JsonIn (json_in.hpp) reads it, data_type_of() (data_type.hpp) makes schemas and references of it.
/// A visitor V has, each called in the order in which the members are written:
///     type(name, what)                     name of this type in TypeScript and schemas; may be left out
///     add(name, unit, what, value, limits) a member; `value` may be a local variable or a view if it is never read
///     group(name, type, what, members)     an object without a struct: members(v) adds its members
///     choose(name, what, value, cases)     an enumerator that selects further members: cases(value) adds them
///     check(good, message)                 a condition on the values; evaluated only by JsonIn
/// and describe(v, other) puts another struct's members in place. Values are numbers, flags, texts, enumerators that
/// have Names, Time, Vector3, Quaternion, Pose, joint vectors, RawJson, described structs, std::optional of those,
/// lists (types with begin() and size()) and maps (lists of pairs of a text and a value).
namespace steadyhand {

/// Limits of a member's value, in addition to its type. Combined as in `within(0.0, 1.0).or_null()`.
struct Limits {
  double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
  bool above = false;                                                     ///< min itself is not allowed
  std::size_t least = 0, most = std::numeric_limits<std::size_t>::max();  ///< bytes of a text, entries of a list
  bool lines = false;                                                     ///< the text may have control characters
  bool null = false;             ///< null is NaN, or the std::optional without a value, which is left out otherwise
  bool optional = false;         ///< may be left out; then it has its default. Empty texts are not written
  const char* format = nullptr;  ///< of numbers that grow, as fmt's; null: as the style's other numbers
  std::string_view known = {};   ///< TypeScript's type of what is handed on

  constexpr Limits or_null() const { return with(&Limits::null, true); }
  constexpr Limits or_absent() const { return with(&Limits::optional, true); }
  constexpr Limits with_lines() const { return with(&Limits::lines, true); }
  constexpr Limits formatted(const char* as) const { return with(&Limits::format, as); }
  /// Entries of a list, or bytes of a text.
  constexpr Limits sized(std::size_t from, std::size_t to) const {
    return with(&Limits::least, from).with(&Limits::most, to);
  }
  template <typename T>
  constexpr Limits with(T Limits::*member, T value) const {
    Limits other = *this;
    other.*member = value;
    return other;
  }
};
constexpr Limits within(double min, double max) { return {.min = min, .max = max}; }
/// Within, without min itself.
constexpr Limits up_to(double max) { return {.min = 0.0, .max = max, .above = true}; }
constexpr Limits at_least(double min) { return {.min = min}; }
constexpr Limits above(double min) { return {.min = min, .above = true}; }
constexpr Limits sized(std::size_t least, std::size_t most) { return {.least = least, .most = most}; }
constexpr Limits known_as(std::string_view type) { return {.known = type}; }
inline constexpr Limits kOrNull{.null = true};
inline constexpr Limits kOrAbsent{.optional = true};

/// JSON that is handed on as it is. Empty: null.
template <typename Text = std::string>
struct RawJson {
  Text text;
};
template <typename Text>
RawJson(Text) -> RawJson<Text>;

namespace description {

/// Tries whether a type is described: takes everything and does nothing.
struct Probe {
  void type(std::string_view, std::string_view) {}
  void add(std::string_view, std::string_view, std::string_view, const auto&, const Limits& = {}) {}
  void group(std::string_view, std::string_view, std::string_view, const auto&) {}
  void choose(std::string_view, std::string_view, const auto&, const auto&) {}
  void check(bool, const auto&) {}
};

template <typename T>
concept Described = std::is_class_v<T> && requires(Probe& v, T& value) { describe(v, value); };
template <typename T>
concept Text = std::convertible_to<const T&, std::string_view>;
template <typename T>
inline constexpr bool kIsOptional = false;
template <typename T>
inline constexpr bool kIsOptional<std::optional<T>> = true;
template <typename T>
inline constexpr bool kIsRaw = false;
template <typename T>
inline constexpr bool kIsRaw<RawJson<T>> = true;
template <typename T>
inline constexpr std::size_t kFixedSize = 0;  ///< of lists that grow
template <typename T, std::size_t N>
inline constexpr std::size_t kFixedSize<std::array<T, N>> = N;
template <typename T>
concept Matrix = std::derived_from<T, Eigen::MatrixBase<T>>;
template <typename T>
concept List = !Text<T> && !Matrix<T> && std::ranges::sized_range<const T>;
template <typename T>
concept Entry = requires(const T& entry) {
  { entry.first } -> Text;
  entry.second;
};
template <typename T>
concept Map = List<T> && Entry<std::ranges::range_value_t<T>>;

}  // namespace description

/// The format of messages for users' programs. Another style is a struct that overrides any part of it:
/// `static void write(JsonWriter&, const T&, const Limits&)` for each type T that it writes in its own way, with what
/// DataType and JsonIn require for that type. Or `static Form form_of(const T&)`, where the type Form replaces T, and,
/// if T is read, `static T from_form(const Form&, std::type_identity<T>)`.
struct PlainStyle {
  static constexpr auto kDigits = JsonWriter::Digits::kShortest;
};
/// The same in six digits, for what people look at.
struct BriefStyle {
  static constexpr auto kDigits = JsonWriter::Digits::kSix;
};

/// Writes described structs. Numbers that are not finite become null. Allocates only what the buffer needs.
template <typename Style = PlainStyle>
class JsonOut {
 public:
  explicit JsonOut(JsonBuffer& out) : json_(out, Style::kDigits) {}

  void type(std::string_view, std::string_view) {}
  template <typename T>
  void add(std::string_view name, std::string_view, std::string_view, const T& value, const Limits& limits = {}) {
    if constexpr (description::kIsOptional<T>) {
      if (!value && !limits.null) return;
    } else if constexpr (description::Text<T>) {
      if (limits.optional && std::string_view(value).empty()) return;
    }
    json_.key(name);
    put(value, limits);
  }
  template <typename Members>
  void group(std::string_view name, std::string_view, std::string_view, const Members& members) {
    json_.key(name);
    json_.begin_object();
    members(*this);
    json_.end_object();
  }
  template <Named Enum, typename Cases>
  void choose(std::string_view name, std::string_view, const Enum& value, const Cases& cases) {
    json_.member(name, to_string(value));
    cases(value);
  }
  void check(bool, const auto&) {}

  /// A value, of any type that a member may have.
  template <typename T>
  void put(const T& value, const Limits& limits = {}) {
    if constexpr (requires { Style::write(json_, value, limits); }) {
      Style::write(json_, value, limits);
    } else if constexpr (requires { Style::form_of(value); }) {
      put(Style::form_of(value), limits);
    } else if constexpr (description::kIsOptional<T>) {
      value ? put(*value, limits) : json_.raw("null");
    } else if constexpr (std::is_same_v<T, Time>) {
      json_.value(to_seconds(value), limits.format ? limits.format : "{:.6f}");
    } else if constexpr (std::floating_point<T>) {
      limits.format ? json_.value(value, limits.format) : json_.value(value);
    } else if constexpr (Named<T>) {
      json_.value(to_string(value));
    } else if constexpr (description::kIsRaw<T>) {
      json_.raw(value.text.empty() ? std::string_view("null") : std::string_view(value.text));
    } else if constexpr (std::is_same_v<T, Quaternion>) {
      json_.value(value.coeffs());  // x, y, z, w
    } else if constexpr (description::Matrix<T>) {
      json_.value(value);
    } else if constexpr (description::Map<T>) {
      json_.begin_object();
      for (const auto& [key, entry] : value) {
        json_.key(key);
        put(entry, limits);
      }
      json_.end_object();
    } else if constexpr (description::List<T>) {
      json_.begin_array();
      for (const auto& entry : value) put(entry, limits);
      json_.end_array();
    } else if constexpr (description::Described<T>) {
      json_.begin_object();
      members(value);
      json_.end_object();
    } else {
      json_.value(value);
    }
  }
  /// The members of a struct, without the brackets around them.
  template <typename T>
  void members(const T& value) {
    describe(*this, const_cast<T&>(value));  // which this visitor reads alone
  }
  JsonWriter& json() { return json_; }

 private:
  JsonWriter json_;
};

/// In the style of pages: its place and its orientation, x, y, z, w.
template <typename V>
void describe(V& v, Pose& X) {
  v.type("Pose", "Position, m, and orientation as a unit quaternion x, y, z, w.");
  v.add("p", "m", "position", X.p);
  v.add("q", "", "orientation x, y, z, w", X.q);
}

}  // namespace steadyhand
