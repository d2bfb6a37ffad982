#include "steadyhand/core/data_type.hpp"

#include <cmath>
#include <utility>

namespace steadyhand {
namespace {

using Kind = DataType::Kind;

void write_type(JsonWriter& json, const DataType& type, bool closed, std::string description);

void write_kind(JsonWriter& json, std::string_view kind, bool null) {
  json.key("type");
  if (!null) return json.value(kind);
  json.begin_array();
  json.value(kind);
  json.value("null");
  json.end_array();
}

void write_range(JsonWriter& json, const Limits& limits) {
  if (std::isfinite(limits.min)) json.member(limits.above ? "exclusiveMinimum" : "minimum", limits.min);
  if (std::isfinite(limits.max)) json.member("maximum", limits.max);
}

void write_sizes(JsonWriter& json, const Limits& limits, std::string_view least, std::string_view most) {
  if (limits.least > 0) json.member(least, limits.least);
  if (limits.most != std::string::npos) json.member(most, limits.most);
}

std::string description_of(const DataType::Member& member) {
  if (member.unit.empty() || member.what.empty()) return member.unit + member.what;
  return member.what + ", " + member.unit;
}

/// "what it is: `a` (the first), `b`"
std::string with_values(std::string description, const DataType& type) {
  std::string_view before = description.empty() ? "" : ": ";
  for (const auto& [name, what] : type.enumerators) {
    description.append(before).append("`" + name + "`" + (what.empty() ? "" : " (" + what + ")"));
    before = ", ";
  }
  return description;
}

/// @param value of the choice, which the last of `members` is; null: there is none
void write_object(JsonWriter& json, const DataType& type, const DataType::Case* value, bool closed) {
  write_kind(json, "object", type.limits.null && !value);
  std::vector<const DataType::Member*> members;
  for (const auto& member : type.members) members.push_back(&member);
  if (value) {
    for (const auto& member : value->members) members.push_back(&member);
  }
  json.key("properties");
  json.begin_object();
  for (const auto* member : members) {
    json.key(member->name);
    if (value && member->name == type.choice) {
      json.begin_object();
      json.member("const", value->value.name);
      json.end_object();
    } else {
      write_type(json, member->type.front(), closed, description_of(*member));
    }
  }
  json.end_object();
  if (!closed) return;
  json.key("required");
  json.begin_array();
  for (const auto* member : members) {
    if (member->required) json.value(member->name);
  }
  json.end_array();
  json.member("additionalProperties", false);
}

void write_cases(JsonWriter& json, const DataType& type, bool closed) {
  json.key("anyOf");
  json.begin_array();
  if (type.limits.null) {
    json.begin_object();
    json.member("type", "null");
    json.end_object();
  }
  for (const auto& value : type.cases) {
    json.begin_object();
    if (!value.value.what.empty()) json.member("description", value.value.what);
    write_object(json, type, &value, closed);
    json.end_object();
  }
  json.end_array();
}

void write_enumerator(JsonWriter& json, const DataType& type) {
  if (type.enumerators.size() == 1 && !type.limits.null) return json.member("const", type.enumerators[0].name);
  json.key("enum");
  json.begin_array();
  for (const auto& entry : type.enumerators) json.value(entry.name);
  if (type.limits.null) json.raw("null");
  json.end_array();
}

void write_type(JsonWriter& json, const DataType& type, bool closed, std::string description) {
  json.begin_object();
  if (closed && type.enumerators.size() > 1) description = with_values(std::move(description), type);
  if (!description.empty()) json.member("description", description);
  switch (type.kind) {
    case Kind::kNumber:
    case Kind::kWhole:
      write_kind(json, type.kind == Kind::kWhole ? "integer" : "number", type.limits.null);
      if (type.kind == Kind::kWhole && !type.is_signed && !std::isfinite(type.limits.min)) json.member("minimum", 0);
      write_range(json, type.limits);
      break;
    case Kind::kFlag:
      write_kind(json, "boolean", type.limits.null);
      break;
    case Kind::kText:
      write_kind(json, "string", type.limits.null);
      write_sizes(json, type.limits, "minLength", "maxLength");
      if (!type.encoding.empty()) json.member("contentEncoding", type.encoding);
      break;
    case Kind::kEnumerator:
      write_enumerator(json, type);
      break;
    case Kind::kList:
      write_kind(json, "array", type.limits.null);
      json.key("items");
      write_type(json, type.items.front(), closed, "");
      write_sizes(json, type.limits, "minItems", "maxItems");
      break;
    case Kind::kMap:
      write_kind(json, "object", type.limits.null);
      json.key("additionalProperties");
      write_type(json, type.items.front(), closed, "");
      break;
    case Kind::kObject:
      type.cases.empty() ? write_object(json, type, nullptr, closed) : write_cases(json, type, closed);
      break;
    case Kind::kJson:
      write_kind(json, "object", type.limits.null);
      break;
  }
  json.end_object();
}

}  // namespace

void write_schema(JsonWriter& json, const DataType& type, bool closed) { write_type(json, type, closed, type.what); }

}  // namespace steadyhand
