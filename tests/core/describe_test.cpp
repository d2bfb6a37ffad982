#include "steadyhand/core/describe.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <ranges>
#include <string>
#include <vector>

#include "steadyhand/core/data_type.hpp"
#include "steadyhand/core/json_in.hpp"
#include "support/allocation_guard.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

enum class Drink : std::uint8_t { kWater, kTea };
constexpr auto names_of(Drink) {
  return named("Drink", {Name{Drink::kWater, "water"}, Name{Drink::kTea, "tea", "which is hot"}});
}

struct Cup {
  double fill = 0.0;
  std::optional<bool> clean;
};
template <typename V>
void describe(V& v, Cup& c) {
  v.type("Cup", "What one drinks from.");
  v.add("fill", "m", "of liquid", c.fill, within(0.0, 0.5).or_null());
  v.add("clean", "", "whether it was washed", c.clean, kOrNull);
}

struct Tray {
  Time at{0};
  Drink drink = Drink::kWater;
  double heat = 20.0;
  std::string name, note;
  std::uint32_t count = 0;
  int floor = 0;
  Pose X_base_tray;
  JointVector q;
  std::vector<Cup> cups;
  std::array<int, 2> place{};
  std::map<std::string, double> weights;
  std::optional<double> slope;
  double width = 0.5;
};
template <typename V>
void describe(V& v, Tray& t) {
  v.type("Tray", "");
  v.add("at_s", "s", "", t.at);
  v.add("name", "", "", t.name, sized(1, 8));
  v.add("note", "", "", t.note, kOrAbsent);
  v.add("count", "", "", t.count);
  v.add("floor", "", "", t.floor, within(-2, 2));
  v.add("pose", "", "in the base", t.X_base_tray);
  v.add("joints", "rad", "", t.q);
  v.add("cups", "", "", t.cups, sized(0, 3));
  v.add("place", "", "", t.place);
  v.add("weights", "", "", t.weights);
  v.add("slope", "rad", "", t.slope);
  v.group("size", "", "", [&](auto& inner) { inner.add("width", "m", "", t.width); });
  v.choose("drink", "", t.drink, [&](Drink drink) {
    if (drink == Drink::kTea) v.add("heat", "C", "of it", t.heat, above(0.0));
  });
  v.check(t.name != "lost", "'name' must not be lost");
}

Tray full_tray() {
  Tray t;
  t.at = from_seconds(1.5);
  t.drink = Drink::kTea;
  t.heat = 80.25;
  t.name = "left";
  t.count = 3;
  t.floor = -1;
  t.X_base_tray.p = {0.5, 0.0, 0.25};
  t.q.setConstant(2, 0.125);
  t.cups = {{0.0625, true}, {std::numeric_limits<double>::quiet_NaN(), std::nullopt}};
  t.place = {4, 5};
  t.weights = {{"near", 2.0}};
  return t;
}

constexpr std::string_view kFull =
    R"({"at_s":1.500000,"name":"left","count":3,"floor":-1,"pose":{"p":[0.5,0,0.25],"q":[0,0,0,1]},)"
    R"("joints":[0.125,0.125],"cups":[{"fill":0.0625,"clean":true},{"fill":null,"clean":null}],"place":[4,5],)"
    R"("weights":{"near":2},"size":{"width":0.5},"drink":"tea","heat":80.25})";

std::string written(const Tray& tray) {
  std::string out;
  JsonOut<> json(out);
  json.put(tray);
  return out;
}

/// The mistake in the full tray after this merge patch; empty: there is none.
std::string mistake(const std::string& patch, Tray* read = nullptr) {
  Json json = Json::parse(kFull);
  json.merge_patch(Json::parse(patch));
  Tray tray;
  JsonIn in(json, true);
  in.members(tray);
  if (read) *read = tray;
  return in.error() ? in.error()->message : "";
}

TEST(Describe, WritesMembersInTheirOrder) { EXPECT_EQ(written(full_tray()), kFull); }

TEST(Describe, WritingAllocatesNothingButTheBuffer) {
  const Tray tray = full_tray();
  std::string out;
  out.reserve(1000);
  const AllocationGuard guard;
  JsonOut<> json(out);
  json.put(tray);
  EXPECT_EQ(guard.count(), 0u);
}

TEST(Describe, ReadsWhatItHasWritten) {
  Tray read;
  EXPECT_EQ(mistake("{}", &read), "");
  EXPECT_EQ(written(read), kFull);
  EXPECT_EQ(mistake(R"({"slope": 1, "note": "wet"})", &read), "");
  EXPECT_EQ(read.slope, 1.0);
  EXPECT_EQ(read.note, "wet");
}

TEST(Describe, NamesMemberValueAndWhatWouldBeRight) {
  const std::pair<const char*, const char*> kMistakes[] = {
      {R"({"name": null})", "'name' is missing"},
      {R"({"name": 7})", "'name' must be text, not 7"},
      {R"({"name": ""})", "'name' must not be empty"},
      {R"({"name": "too long a name"})", "'name' has 15 bytes; it must have 8 at most"},
      {R"({"name": "a\u001b"})", R"('name' must be without control characters, not "a\u001b")"},
      {R"({"name": "lost"})", "'name' must not be lost"},
      {R"({"count": -1})", "'count' must be a whole number >= 0, not -1"},
      {R"({"count": 5000000000})", "'count' must be a whole number >= 0, not 5000000000"},
      {R"({"floor": 3})", "'floor' must be within -2 and 2, not 3"},
      {R"({"floor": 0.5})", "'floor' must be a whole number, not 0.5"},
      {R"({"pose": {"p": [0, 0]}})", "'pose.p' must be a list of 3 numbers, not [0,0]"},
      {R"({"pose": {"q": [0, 0, 0, 2]}})", "'pose.q' must be a unit quaternion x, y, z, w; its norm is 2"},
      {R"({"pose": {"r": 1}})", "'pose.r' is unknown; there are p, q"},
      {R"({"pose": {"": 1}})", "'pose.\"\"' is unknown; there are p, q"},
      {R"({"joints": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]})",
       "'joints' has 17 entries; it must have 16 at most"},
      {R"({"joints": [true]})", "'joints' must be a number, not true"},
      {R"({"cups": [{"fill": 2, "clean": null}]})", "'cups[0].fill' must be within 0 and 0.5, not 2"},
      {R"({"cups": [{"clean": null}]})", "'cups[0].fill' is missing"},
      {R"({"place": [1]})", "'place' must be a list of 2 entries, not [1]"},
      {R"({"weights": {"near": "much"}})", R"('weights.near' must be a number, not "much")"},
      {R"({"size": {"width": "wide"}})", R"('size.width' must be a number, not "wide")"},
      {R"({"size": {"depth": 1}})", "'size.depth' is unknown; there are width"},
      {R"({"drink": "milk"})", R"('drink' must be water or tea, not "milk")"},
      {R"({"drink": "water"})",
       "'heat' is unknown; there are at_s, name, note, count, floor, pose, joints, cups, place, weights, slope, size, "
       "drink"},
      {R"({"heat": 0})", "'heat' must be above 0, not 0"},
      {R"({"more": 1})",
       "'more' is unknown; there are at_s, name, note, count, floor, pose, joints, cups, place, weights, slope, size, "
       "drink, heat"}};
  for (const auto& [patch, says] : kMistakes) EXPECT_EQ(mistake(patch), says) << patch;
}

TEST(Describe, WritesViewsAndTellsTheirTypes) {
  const auto squares = [](int n) {
    return std::views::iota(0, n) | std::views::transform([](int i) { return i * i; });
  };
  std::string out;
  JsonOut<> json(out);
  json.put(squares(3));
  EXPECT_EQ(out, "[0,1,4]");
  const DataType type = DataTypeMaker<>::make<decltype(squares(3))>();
  EXPECT_EQ(type.kind, DataType::Kind::kList);
  EXPECT_EQ(type.items.front().kind, DataType::Kind::kWhole);
}

/// Times as whole hundredths of a second.
struct WholeStyle : PlainStyle {
  static int form_of(const Time& t) { return static_cast<int>(t / std::chrono::milliseconds(10)); }
  static Time from_form(int form, std::type_identity<Time>) { return form * std::chrono::milliseconds(10); }
};

TEST(Describe, StylesReplaceWhatStandsInTheFile) {
  std::string out;
  JsonOut<WholeStyle> writer(out);
  writer.put(full_tray());
  const Json json = Json::parse(out);
  EXPECT_EQ(json["at_s"], 150);
  Tray read;
  JsonIn<Json, WholeStyle> in(json, true);
  in.members(read);
  EXPECT_FALSE(in.error()) << in.error()->message;
  EXPECT_EQ(written(read), kFull);
  const DataType type = data_type_of<Tray, WholeStyle>();
  EXPECT_EQ(type.members.front().type.front().kind, DataType::Kind::kWhole);
}

TEST(Describe, TellsMembersTypesAndChoices) {
  const DataType type = data_type_of<Tray>();
  EXPECT_EQ(type.name, "Tray");
  ASSERT_EQ(type.members.size(), 13u);
  EXPECT_EQ(type.choice, "drink");
  ASSERT_EQ(type.cases.size(), 2u);
  EXPECT_EQ(type.cases[1].value.what, "which is hot");
  EXPECT_EQ(type.cases[1].members.front().name, "heat");
  EXPECT_FALSE(type.members[2].required);
  std::string out;
  JsonWriter json(out);
  write_schema(json, type, true);
  const Json schema = Json::parse(out);
  const Json& tea = schema["anyOf"][1];
  EXPECT_EQ(tea["properties"]["drink"], Json::parse(R"({"const": "tea"})"));
  EXPECT_EQ(tea["properties"]["heat"],
            Json::parse(R"({"description": "of it, C", "type": "number", "exclusiveMinimum": 0})"));
  EXPECT_EQ(tea["properties"]["pose"]["properties"]["p"],
            Json::parse(R"({"description": "position, m", "type": "array", "items": {"type": "number"}, "minItems": 3,
                            "maxItems": 3})"));
  EXPECT_EQ(tea["properties"]["cups"]["items"]["properties"]["clean"]["type"], Json::parse(R"(["boolean", "null"])"));
  EXPECT_EQ(tea["properties"]["weights"]["additionalProperties"], Json::parse(R"({"type": "number"})"));
  EXPECT_EQ(tea["additionalProperties"], false);
  EXPECT_EQ(tea["required"].size(), 12u);  // neither note nor slope
  out.clear();
  JsonWriter drinks(out);
  write_schema(drinks, data_type_of<Drink>(), true);
  EXPECT_EQ(Json::parse(out)["description"], "`water`, `tea` (which is hot)");
}

}  // namespace
}  // namespace steadyhand
