#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "steadyhand/core/describe.hpp"

namespace steadyhand {

/// A described type as data, of which schemas and references are made.
struct DataType {
  enum class Kind { kNumber, kWhole, kFlag, kText, kEnumerator, kList, kMap, kObject, kJson };
  struct Enumerator {
    std::string name, what;
  };
  struct Member {
    std::string name, unit, what;
    bool required = true;
    std::vector<DataType> type;  ///< one
  };
  /// Members that an object has besides, where the member `Object::choice` is `value`.
  struct Case {
    Enumerator value;
    std::vector<Member> members;
  };

  Kind kind = Kind::kObject;
  std::string name, what;  ///< of objects and enumerations; may be empty
  std::string encoding;    ///< how a kText encodes bytes, e.g. "base64"; empty: it is plain text
  Limits limits;
  bool is_signed = true;                ///< of kWhole
  std::vector<DataType> items;          ///< one: of lists and maps
  std::vector<Enumerator> enumerators;  ///< of kEnumerator
  std::vector<Member> members;          ///< of objects; a choice among them is the last
  std::string choice;                   ///< of objects: the member on which `cases` depend
  std::vector<Case> cases;
};

/// Makes a DataType by visiting a description. A style may have `static DataType data_type(std::type_identity<T>)`.
template <typename Style = PlainStyle>
class DataTypeMaker {
 public:
  explicit DataTypeMaker(DataType& object) : object_(&object), members_(&object.members) {}

  void type(std::string_view name, std::string_view what) {
    if (!object_->name.empty()) return;  // another's members in its place
    object_->name = name;
    object_->what = what;
  }
  template <typename T>
  void add(std::string_view name, std::string_view unit, std::string_view what, const T&, const Limits& limits = {}) {
    const bool required = !limits.optional && (!description::kIsOptional<T> || limits.null);
    members_->push_back({std::string(name), std::string(unit), std::string(what), required, {make<T>(limits)}});
  }
  template <typename Members>
  void group(std::string_view name, std::string_view type, std::string_view what, const Members& members) {
    DataType object;
    object.name = type;
    DataTypeMaker maker(object);
    members(maker);
    members_->push_back({std::string(name), "", std::string(what), true, {std::move(object)}});
  }
  template <Named Enum, typename Cases>
  void choose(std::string_view name, std::string_view what, Enum& value, const Cases& cases) {
    add(name, "", what, value);
    object_->choice = name;
    for (const auto& entry : kNamesOf<Enum>.entries) {
      object_->cases.push_back({{std::string(entry.name), std::string(entry.what)}, {}});
      members_ = &object_->cases.back().members;
      cases(value = entry.value);
    }
    members_ = &object_->members;
  }
  void check(bool, const auto&) {}

  template <typename T>
  static DataType make(const Limits& limits = {}) {
    using Kind = DataType::Kind;
    DataType type;
    type.limits = limits;
    if constexpr (requires { Style::data_type(std::type_identity<T>{}); }) {
      type = Style::data_type(std::type_identity<T>{});
      type.limits = limits;
    } else if constexpr (requires(const T& value) { Style::form_of(value); }) {
      return make<std::remove_cvref_t<decltype(Style::form_of(std::declval<const T&>()))>>(limits);
    } else if constexpr (description::kIsOptional<T>) {
      type = make<typename T::value_type>(limits.with(&Limits::null, false));
      type.limits.null = limits.null;
    } else if constexpr (std::is_same_v<T, bool>) {
      type.kind = Kind::kFlag;
    } else if constexpr (std::is_same_v<T, Time> || std::floating_point<T>) {
      type.kind = Kind::kNumber;
    } else if constexpr (std::integral<T>) {
      type.kind = Kind::kWhole;
      type.is_signed = std::is_signed_v<T>;
    } else if constexpr (Named<T>) {
      type.kind = Kind::kEnumerator;
      type.name = kNamesOf<T>.type;
      for (const auto& entry : kNamesOf<T>.entries) {
        type.enumerators.push_back({std::string(entry.name), std::string(entry.what)});
      }
    } else if constexpr (description::Text<T>) {
      type.kind = Kind::kText;
    } else if constexpr (description::kIsRaw<T>) {
      type.kind = Kind::kJson;
    } else if constexpr (std::is_same_v<T, Quaternion>) {
      return list(make<double>(), 4, 4, limits);
    } else if constexpr (description::Matrix<T>) {
      constexpr int kFixed = T::SizeAtCompileTime, kMost = T::MaxSizeAtCompileTime;
      return list(make<double>(limits.sized(0, std::string::npos)), kFixed > 0 ? kFixed : 0,
                  kMost > 0 ? kMost : std::string::npos, limits);
    } else if constexpr (description::Map<T>) {
      using Mapped = std::remove_cvref_t<decltype(std::declval<std::ranges::range_value_t<T>>().second)>;
      type.kind = Kind::kMap;
      type.items.push_back(make<Mapped>(limits));
    } else if constexpr (description::List<T>) {
      constexpr std::size_t kFixed = description::kFixedSize<T>;
      return list(make<std::remove_cvref_t<std::ranges::range_value_t<T>>>(limits.sized(0, std::string::npos)), kFixed,
                  kFixed > 0 ? kFixed : std::string::npos, limits);
    } else {
      static_assert(description::Described<T>, "has no describe()");
      T value{};
      DataTypeMaker maker(type);
      describe(maker, value);
    }
    return type;
  }

 private:
  static DataType list(DataType item, std::size_t least, std::size_t most, const Limits& limits) {
    DataType type;
    type.kind = DataType::Kind::kList;
    type.limits = Limits{}.sized(std::max(least, limits.least), std::min(most, limits.most));
    type.items.push_back(std::move(item));
    return type;
  }

  DataType* object_;
  std::vector<DataType::Member>* members_;
};

template <typename T, typename Style = PlainStyle>
DataType data_type_of() {
  return DataTypeMaker<Style>::template make<T>();
}

/// JSON Schema (draft 7) of a type. @param closed whether members that it does not have are forbidden, and descriptions
/// name the values of enumerators
void write_schema(JsonWriter& json, const DataType& type, bool closed);

}  // namespace steadyhand
