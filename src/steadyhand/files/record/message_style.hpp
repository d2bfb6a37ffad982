#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "steadyhand/core/base64.hpp"
#include "steadyhand/core/data_type.hpp"

namespace steadyhand {

/// Whether a visitor of descriptions brings values for the members.
template <typename V>
inline constexpr bool kReads = requires(V& v) { v.error(); };

/// Foxglove's forms.
struct Coordinates {
  Vector3 v = Vector3::Zero();
};
template <typename V>
void describe(V& v, Coordinates& c) {
  v.add("x", "", "x coordinate", c.v.x());
  v.add("y", "", "y coordinate", c.v.y());
  v.add("z", "", "z coordinate", c.v.z());
}
struct Orientation {
  Quaternion q = Quaternion::Identity();
};
template <typename V>
void describe(V& v, Orientation& o) {
  v.add("x", "", "x value", o.q.x());
  v.add("y", "", "y value", o.q.y());
  v.add("z", "", "z value", o.q.z());
  v.add("w", "", "w value", o.q.w());
}
struct PointAndOrientation {
  Coordinates position;
  Orientation orientation;
};
template <typename V>
void describe(V& v, PointAndOrientation& X) {
  v.add("position", "m", "Point denoting position in 3D space", X.position);
  v.add("orientation", "", "Quaternion denoting orientation", X.orientation);
}
struct SplitTime {
  std::int64_t sec = 0, nsec = 0;  ///< whole seconds (floored), and the nanoseconds on top
};
template <typename V>
void describe(V& v, SplitTime& t) {
  constexpr double kMost = 9e9;
  v.add("sec", "", "", t.sec, within(-kMost, kMost));
  v.add("nsec", "", "", t.nsec, within(0, 999'999'999));
}

/// Bytes as text, which only programs read.
struct Base64 {
  std::string_view bytes;
};

/// Reads values of files: texts stay as they were written.
struct FileStyle : PlainStyle {
  template <typename In, typename Json>
  static void read(In& in, const Json& json, std::string& value, const Limits&, std::string_view name) {
    if (!json.is_string()) return in.must(name, "text", json);
    value = json.template get<std::string>();
  }
};

/// JSON that cell_json() made; read with read_cell_json().
struct CellText {
  std::string json;
};

/// How recordings look: times and poses as Foxglove has them; null for every number that is not finite.
struct MessageStyle : FileStyle {
  static PointAndOrientation form_of(const Pose& X) { return {{X.p}, {X.q}}; }
  static Pose from_form(const PointAndOrientation& X, std::type_identity<Pose>) {
    return {X.position.v, X.orientation.q};
  }
  static SplitTime form_of(const Time& t) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    const std::int64_t nanoseconds = (t.count() % kSecond + kSecond) % kSecond;
    return {(t.count() - nanoseconds) / kSecond, nanoseconds};
  }
  static Time from_form(const SplitTime& t, std::type_identity<Time>) {
    return std::chrono::seconds(t.sec) + Time(t.nsec);
  }

  static void write(JsonWriter& json, const Base64& data, const Limits&) { json.value(to_base64(data.bytes)); }
  static DataType data_type(std::type_identity<Base64>) {
    DataType type = text_type();
    type.encoding = "base64";
    return type;
  }
  static void write(JsonWriter& json, const CellText& cell, const Limits&) { json.raw(cell.json); }
  static DataType data_type(std::type_identity<CellText>) {
    DataType cell, object, objects;
    object.kind = DataType::Kind::kJson;
    objects.kind = DataType::Kind::kList;
    objects.items = {object};
    cell.members = {{"name", "", "for people", true, {text_type()}}, {"objects", "", "", true, {objects}}};
    return cell;
  }
  template <Named Enum>
  static DataType data_type(std::type_identity<Enum>) {
    return text_type();
  }

  using FileStyle::read;
  template <typename In, typename Json>
  static void read(In& in, const Json& json, double& value, const Limits&, std::string_view name) {
    if (!json.is_null() && !json.is_number()) return in.must(name, "a number, or null", json);
    value = json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.template get<double>();
  }
  template <typename In, typename Json>
  static void read(In& in, const Json& json, std::vector<std::pair<std::string, double>>& values, const Limits& limits,
                   std::string_view name) {
    if (!json.is_object()) return in.must(name, "an object", json);
    values.clear();
    for (const auto& [key, entry] : json.items()) read(in, entry, values.emplace_back(key, 0.0).second, limits, key);
  }

 private:
  static DataType text_type() {
    DataType type;
    type.kind = DataType::Kind::kText;
    return type;
  }
};

struct Schema {
  std::string name, text;
};
/// JSON Schema of messages. Topics that share its name share the text, with the members of all.
template <typename... Messages>
Schema schema_of() {
  DataType all;
  for (const DataType& type : {data_type_of<Messages, MessageStyle>()...}) {
    if (all.name.empty()) all.name = type.name, all.what = type.what;
    for (const DataType::Member& member : type.members) {
      const auto has = [&](const DataType::Member& other) { return other.name == member.name; };
      if (std::none_of(all.members.begin(), all.members.end(), has)) all.members.push_back(member);
    }
  }
  Schema schema{all.name, {}};
  JsonWriter json(schema.text);
  write_schema(json, all, false);
  return schema;
}

}  // namespace steadyhand
