#include "steadyhand/core/json_writer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

namespace steadyhand {
namespace {

using Json = nlohmann::json;

template <typename Write>
std::string written(const Write& write, JsonWriter::Digits digits = JsonWriter::Digits::kShortest) {
  JsonBuffer out;
  JsonWriter json(out, digits);
  write(json);
  return out;
}

TEST(JsonWriter, PutsCommasWhereTheyBelong) {
  const std::string text = written([](JsonWriter& json) {
    json.begin_object();
    json.member("a", 1);
    json.key("empty");
    json.begin_object();
    json.end_object();
    json.member("list", std::vector<std::string>{"x", "y"});
    json.key("nested");
    json.begin_array();
    json.value(std::array{1, 2});
    json.begin_object();
    json.member("flag", true);
    json.end_object();
    json.raw("null");
    json.end_array();
    json.member("none", std::vector<double>{});
    json.end_object();
  });
  EXPECT_EQ(text, R"({"a":1,"empty":{},"list":["x","y"],"nested":[[1,2],{"flag":true},null],"none":[]})");
}

TEST(JsonWriter, NumbersReadBackTheSameUnlessSixDigitsDo) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 1000; ++i) {
    const double number = std::bit_cast<double>(random());
    if (!std::isfinite(number)) continue;
    const std::string text = written([&](JsonWriter& json) { json.value(number); });
    EXPECT_EQ(Json::parse(text).get<double>(), number) << text;
  }
  const auto six = [](double number) {
    return written([&](JsonWriter& json) { json.value(number); }, JsonWriter::Digits::kSix);
  };
  EXPECT_EQ(six(1.0 / 3.0), "0.333333");
  EXPECT_EQ(six(500.0), "500");
  for (const double none : {std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(six(none), "null");
  }
  EXPECT_EQ(written([](JsonWriter& json) { json.value(std::numeric_limits<std::uint64_t>::max()); }),
            "18446744073709551615");
}

/// Bytes from outside, such as a controller's words, cut in the middle of a letter.
TEST(JsonWriter, AnyBytesAreTextAsAnotherLibraryWritesIt) {
  std::mt19937 random(2);
  const std::string special =
      "\"\\/\b\f\n\r\t\x01\x1f\x7f\xc3\xa4\xe2\x82\xac\xf0\x9f\x99\x82\xed\xa0\x80\xc0\xaf\xf4\x90\xf5\xff";
  for (int i = 0; i < 20000; ++i) {
    std::string text;
    for (int length = static_cast<int>(random() % 12); length > 0; --length) {
      if (random() % 2) {
        text += special[random() % special.size()];
      } else {
        text += static_cast<char>(random() % 256);
      }
    }
    const std::string ours = written([&](JsonWriter& json) { json.value(text); });
    ASSERT_EQ(ours, Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)) << i;
  }
}

}  // namespace
}  // namespace steadyhand
