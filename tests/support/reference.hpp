#pragma once

#include <set>
#include <string>
#include <vector>

#include "steadyhand/core/data_type.hpp"

/// Described types for TypeScript.
namespace steadyhand {

inline std::string joined(const std::vector<std::string>& parts, const std::string& between) {
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : between) + part;
  return all;
}

/// "what, unit"
inline std::string remark(const DataType::Member& member) {
  return member.what + (member.what.empty() || member.unit.empty() ? "" : ", ") + member.unit;
}

/// Declarations of types, each once, those that others are made of first.
class TypeScript {
 public:
  using Kind = DataType::Kind;

  /// A type as it is named where it is used. Declares it, if it has a name.
  std::string use(const DataType& type) {
    const std::string name = plain(type);
    if (!type.limits.null) return name;
    return name == "number" ? "Measure" : name + " | null";
  }
  void line(const std::string& text) { text_ += text + "\n"; }
  const std::string& text() const { return text_; }
  /// Types that are declared elsewhere.
  const std::set<std::string>& known() const { return known_; }

 private:
  std::string plain(const DataType& type) {
    switch (type.kind) {
      case Kind::kNumber:
      case Kind::kWhole:
        return "number";
      case Kind::kFlag:
        return "boolean";
      case Kind::kText:
        return "string";
      case Kind::kEnumerator:
        return enumeration(type);
      case Kind::kList:
        return list(type);
      case Kind::kMap:
        return "Record<string, " + use(type.items.front()) + ">";
      case Kind::kObject:
        return object(type);
      case Kind::kJson:
        break;
    }
    if (type.limits.known.empty()) return "object";
    known_.emplace(type.limits.known);
    return std::string(type.limits.known);
  }
  std::string list(const DataType& type) {
    const std::string item = use(type.items.front());
    const std::size_t size = type.limits.least == type.limits.most ? type.limits.most : 0;
    if (item == "number" && size == 3) return "Vec3";
    if (item == "number" && size == 4) return "Quat";
    if (size > 0) return "[" + joined(std::vector<std::string>(size, item), ", ") + "]";
    return item.find('|') == std::string::npos ? item + "[]" : "(" + item + ")[]";
  }
  std::string enumeration(const DataType& type) {
    std::vector<std::string> names;
    for (const auto& entry : type.enumerators) names.push_back("'" + entry.name + "'");
    if (names.size() == 1) return names[0];
    if (declared_.insert(type.name).second) {
      line("\nexport type " + type.name + " = " + joined(names, " | ") + ";");
    }
    return type.name;
  }
  std::string object(const DataType& type) {
    if (type.name.empty()) return "{ " + joined(members(type.members, "", false), "; ") + " }";
    if (!declared_.insert(type.name).second) return type.name;
    std::vector<std::string> own;
    for (const auto& member : type.members) {
      if (member.name != type.choice) own.push_back(declaration(member, true));
    }
    const std::string what = type.what.empty() ? "" : "\n/** " + type.what + " */";
    const std::string short_form = "{ " + joined(own, " ") + " }";
    const std::string common = short_form.size() < 100 ? short_form : "{\n  " + joined(own, "\n  ") + "\n}";
    if (type.cases.empty()) {
      line(what + "\nexport interface " + type.name + " " + common);
    } else {
      line(what + "\nexport type " + type.name + " = " + common + " & (" + cases(type) + "\n);");
    }
    return type.name;
  }
  /// Those of the same members together.
  std::string cases(const DataType& type) {
    std::vector<std::pair<std::string, std::string>> alternatives;  // members, names
    for (const auto& value : type.cases) {
      const std::string has = joined(members(value.members, "; ", false), "");
      const auto same =
          std::find_if(alternatives.begin(), alternatives.end(), [&](const auto& a) { return a.first == has; });
      const std::string name = "'" + value.value.name + "'";
      same == alternatives.end() ? alternatives.emplace_back(has, name).second : same->second += " | " + name;
    }
    std::string all;
    for (const auto& [has, names] : alternatives) all += "\n  | { " + type.choice + ": " + names + has + " }";
    return all;
  }
  std::vector<std::string> members(const std::vector<DataType::Member>& members, const std::string& before,
                                   bool remarks) {
    std::vector<std::string> all;
    for (const auto& member : members) all.push_back(before + declaration(member, remarks));
    return all;
  }
  std::string declaration(const DataType::Member& member, bool remarks) {
    const std::string type = use(member.type.front());
    const std::string text = member.name + (member.required ? ": " : "?: ") + type;
    if (!remarks) return text;
    return (remark(member).empty() ? "" : "/** " + remark(member) + " */ ") + text + ";";
  }

  std::string text_;
  std::set<std::string> declared_, known_;
};

}  // namespace steadyhand
