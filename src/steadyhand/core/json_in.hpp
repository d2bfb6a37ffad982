#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/core/describe.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/text.hpp"

namespace steadyhand {

/// A JSON value as text, short enough for a message.
template <typename Json>
std::string excerpt(const Json& json) {
  constexpr std::size_t kMost = 60;
  std::string text = json.dump(-1, ' ', true, Json::error_handler_t::replace);
  return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
}

/// Reads a described struct from a JSON object. Keeps the first error; values that are read after it are meaningless.
template <typename Json, typename Style = PlainStyle>
class JsonIn {
 public:
  /// @param strict unknown members are an error
  JsonIn(const Json& object, bool strict) : object_(&object), strict_(strict) {}

  /// Reads all members.
  template <typename T>
  void members(T& value) {
    visit([&](auto& v) { describe(v, value); });
  }
  const std::optional<Error>& error() const { return error_; }
  /// The first error.
  void fail(std::string message) {
    if (!error_) error_ = Error{std::move(message)};
  }
  /// The member is no such thing.
  void must(std::string_view name, std::string_view be, const Json& json) {
    fail(fmt::format("{} must be {}, not {}", place(name), be, excerpt(json)));
  }
  /// This member was read elsewhere.
  void skip(std::string_view name) {
    ++known_;
    skipped_ = name;
  }

  void type(std::string_view, std::string_view) {}
  template <typename T>
  void add(std::string_view name, std::string_view, std::string_view, T& value, const Limits& limits = {}) {
    const auto found = object_->find(name);
    if (found == object_->end()) {
      if (!limits.optional && (!description::kIsOptional<T> || limits.null)) {
        fail(fmt::format("{} is missing", place(name)));
      }
      return;
    }
    ++known_;
    get(*found, value, limits, name);
  }
  template <typename Members>
  void group(std::string_view name, std::string_view, std::string_view, const Members& members) {
    const auto found = object_->find(name);
    if (found == object_->end()) return fail(fmt::format("{} is missing", place(name)));
    ++known_;
    JsonIn inner(*found, *this, name);
    inner.visit(members);
    take_error(inner);
  }
  template <Named Enum, typename Cases>
  void choose(std::string_view name, std::string_view what, Enum& value, const Cases& cases) {
    add(name, "", what, value);
    if (!error_) cases(value);
  }
  void check(bool good, const auto& message) {
    if (!good) fail(outer_ ? fmt::format("{}: {}", place(), message) : std::string(message));
  }

 private:
  template <typename Members>
  void visit(const Members& members) {
    if (!object_->is_object()) return fail(fmt::format("{} must be an object, not {}", place(), excerpt(*object_)));
    members(*this);
    if (strict_ && !error_ && known_ != object_->size()) refuse_unknown(members);
  }
  /// A part of another, whose member or entry is called `name`.
  JsonIn(const Json& object, const JsonIn& outer, std::string_view name)
      : object_(&object), strict_(outer.strict_), outer_(&outer), name_(name) {}

  /// Path of this object, or of its member, for messages: 'outer.name'.
  std::string place(std::string_view name = {}) const {
    std::string path(name);
    for (const JsonIn* at = this; at->outer_; at = at->outer_) {
      path = std::string(at->name_) + (path.empty() ? "" : ".") + path;
    }
    return path.empty() ? "it" : "'" + path + "'";
  }
  void check_size(std::size_t size, const Limits& limits, std::string_view name, std::string_view unit) {
    if (size >= limits.least && size <= limits.most) return;
    if (size == 0) return fail(fmt::format("{} must not be empty", place(name)));
    fail(fmt::format("{} has {} {}; it must have {}", place(name), size, unit,
                     limits.least == limits.most ? fmt::format("{}", limits.most)
                     : size < limits.least       ? fmt::format("{} or more", limits.least)
                                                 : fmt::format("{} at most", limits.most)));
  }

  template <typename T>
  void get(const Json& json, T& value, const Limits& limits, std::string_view name) {
    if constexpr (requires { Style::read(*this, json, value, limits, name); }) {
      Style::read(*this, json, value, limits, name);
    } else if constexpr (requires { Style::form_of(value); }) {
      auto form = Style::form_of(value);
      get(json, form, limits, name);
      value = Style::from_form(form, std::type_identity<T>{});
    } else if constexpr (description::kIsOptional<T>) {
      if (limits.null && json.is_null()) return value.reset();
      get(json, value.emplace(), limits.with(&Limits::null, false), name);
    } else if constexpr (std::is_same_v<T, bool>) {
      if (!json.is_boolean()) return must(name, "true or false", json);
      value = json.template get<bool>();
    } else if constexpr (std::is_same_v<T, Time>) {
      double seconds = 0.0;
      get(json, seconds, limits, name);
      if (std::abs(seconds) < 9e9) value = from_seconds(seconds);
    } else if constexpr (std::integral<T>) {
      get_whole(json, value, limits, name);
    } else if constexpr (std::floating_point<T>) {
      get_number(json, value, limits, name);
    } else if constexpr (Named<T>) {
      get_name(json, value, name);
    } else if constexpr (std::is_same_v<T, std::string>) {
      get_text(json, value, limits, name);
    } else if constexpr (description::kIsRaw<T>) {
      if (!json.is_object() && !(limits.null && json.is_null())) {
        return must(name, limits.null ? "an object, or null" : "an object", json);
      }
      value.text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    } else if constexpr (std::is_same_v<T, Quaternion>) {
      get_quaternion(json, value, name);
    } else if constexpr (description::Matrix<T>) {
      get_vector(json, value, limits, name);
    } else if constexpr (description::Map<T>) {
      if (!json.is_object()) return must(name, "an object", json);
      value.clear();
      for (const auto& [key, entry] : json.items()) {
        JsonIn inner(json, *this, name);
        inner.get(entry, value.emplace_hint(value.end(), key, typename T::mapped_type{})->second, limits, key);
        take_error(inner);
      }
    } else if constexpr (description::List<T>) {
      get_list(json, value, limits, name);
    } else {
      JsonIn inner(json, *this, name);
      inner.members(value);
      take_error(inner);
    }
  }
  void take_error(const JsonIn& inner) {
    if (inner.error_) fail(inner.error_->message);
  }

  void get_number(const Json& json, std::floating_point auto& value, const Limits& limits, std::string_view name) {
    if (limits.null && json.is_null()) {
      value = std::numeric_limits<double>::quiet_NaN();
      return;
    }
    if (!json.is_number()) return must(name, limits.null ? "a number, or null" : "a number", json);
    check_range(json.template get<double>(), limits, name);
    value = json.template get<double>();
  }
  template <typename T>
  void get_whole(const Json& json, T& value, const Limits& limits, std::string_view name) {
    const bool fits = json.is_number_unsigned()
                          ? std::in_range<T>(json.template get<std::uint64_t>())
                          : json.is_number_integer() && std::in_range<T>(json.template get<std::int64_t>());
    if (!fits) return must(name, std::is_signed_v<T> ? "a whole number" : "a whole number >= 0", json);
    value = json.template get<T>();
    check_range(static_cast<double>(value), limits, name);
  }
  void check_range(double x, const Limits& limits, std::string_view name) {
    if (x >= limits.min && x <= limits.max && !(limits.above && x == limits.min)) return;
    const bool bounded = std::isfinite(limits.max);
    fail(fmt::format("{} must be {}{}, not {:g}", place(name),
                     !bounded ? fmt::format("{} {:g}", limits.above ? "above" : "at least", limits.min)
                              : fmt::format("within {:g} and {:g}", limits.min, limits.max),
                     bounded && limits.above ? fmt::format(" and above {:g}", limits.min) : "", x));
  }
  template <Named Enum>
  void get_name(const Json& json, Enum& value, std::string_view name) {
    if (json.is_string()) {
      if (const auto found = find_name<Enum>(json.template get_ref<const std::string&>())) {
        value = *found;
        return;
      }
    }
    std::string known;
    const auto& entries = kNamesOf<Enum>.entries;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      known += i == 0 ? "" : i + 1 == entries.size() ? " or " : ", ";
      known += entries[i].name;
    }
    must(name, known, json);
  }
  /// Without control characters unless it may have lines: it may be shown on a terminal, or become a name.
  void get_text(const Json& json, std::string& value, const Limits& limits, std::string_view name) {
    if (!json.is_string()) return must(name, "text", json);
    value = json.template get_ref<const std::string&>();
    check_size(value.size(), limits, name, "bytes");
    if (!limits.lines && !value.empty() && !is_name(value)) {
      fail(fmt::format("{} must be without control characters, not {}", place(name), excerpt(json)));
    }
  }
  /// @param fixed entries that it must have; 0: any number
  bool get_array(const Json& json, std::size_t fixed, std::string_view name, std::string_view of = "numbers") {
    if (json.is_array() && (fixed == 0 || json.size() == fixed)) return true;
    must(name, fixed == 0 ? fmt::format("a list of {}", of) : fmt::format("a list of {} {}", fixed, of), json);
    return false;
  }
  template <typename T>
  void get_vector(const Json& json, T& value, const Limits& limits, std::string_view name) {
    constexpr int kFixed = T::SizeAtCompileTime, kMost = T::MaxSizeAtCompileTime;
    if (!get_array(json, kFixed == Eigen::Dynamic ? 0 : kFixed, name)) return;
    check_size(json.size(), limits.most > kMost && kMost > 0 ? limits.sized(limits.least, kMost) : limits, name,
               "entries");
    if (error_) return;
    value.resize(static_cast<Eigen::Index>(json.size()));
    for (std::size_t i = 0; i < json.size(); ++i) {
      get(json[i], value[static_cast<Eigen::Index>(i)], limits.sized(0, std::string::npos), name);
    }
  }
  void get_quaternion(const Json& json, Quaternion& value, std::string_view name) {
    Eigen::Vector4d q;
    get_vector(json, q, {}, name);
    if (error_) return;
    const double norm = q.norm();
    if (!(std::abs(norm - 1.0) <= 1e-3)) {
      return fail(fmt::format("{} must be a unit quaternion x, y, z, w; its norm is {:g}", place(name), norm));
    }
    value = Quaternion(q).normalized();
  }
  template <typename T>
  void get_list(const Json& json, T& value, const Limits& limits, std::string_view name) {
    constexpr bool kGrows = requires { value.resize(1); };
    if (!get_array(json, kGrows ? 0 : value.size(), name, "entries")) return;
    check_size(json.size(), limits, name, "entries");
    if (error_) return;
    if constexpr (kGrows) value.resize(json.size());
    for (std::size_t i = 0; i < json.size() && !error_; ++i) {
      get(json[i], value[i], limits.sized(0, std::string::npos), fmt::format("{}[{}]", name, i));
    }
  }
  /// Fails with the name of the first unknown member and the names of all known ones.
  template <typename Members>
  void refuse_unknown(const Members& members) {
    MemberNames known;
    if (skipped_) known.all.push_back(*skipped_);
    members(known);
    for (const auto& [key, entry] : object_->items()) {
      if (std::find(known.all.begin(), known.all.end(), key) != known.all.end()) continue;
      fail(fmt::format("{} is unknown; there are {}", place(key.empty() ? "\"\"" : key), fmt::join(known.all, ", ")));
    }
  }
  struct MemberNames {
    std::vector<std::string_view> all;
    void type(std::string_view, std::string_view) {}
    void add(std::string_view name, std::string_view, std::string_view, auto&, const Limits& = {}) {
      all.push_back(name);
    }
    void group(std::string_view name, std::string_view, std::string_view, const auto&) { all.push_back(name); }
    void choose(std::string_view name, std::string_view, auto& value, const auto& cases) {
      all.push_back(name);
      cases(value);
    }
    void check(bool, const auto&) {}
  };

  const Json* object_;
  bool strict_;
  const JsonIn* outer_ = nullptr;
  std::string_view name_ = {};
  std::optional<std::string_view> skipped_;
  std::size_t known_ = 0;
  std::optional<Error> error_;
};

}  // namespace steadyhand
