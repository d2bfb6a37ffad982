#include <gtest/gtest.h>

#include "steadyhand/files/input/aframe.hpp"

namespace steadyhand {
namespace {

constexpr auto all = [](const std::vector<std::string>& keys) -> Result<std::vector<ChosenHand>> {
  return std::vector{ChosenHand{keys.front()}};
};

/// Refused with a message that fits on a screen, without exhausting the stack.
TEST(AFrame, RefusesHostileFilesBriefly) {
  const std::string endless_key = "{\"" + std::string(1'000'000, 'x');
  const std::string endless_number = "{\"rhand\": " + std::string(1'000'000, '9') + "x}";
  const std::string deep = std::string(1'000'000, '[');
  const std::string deep_and_closed = "{\"rhand\": " + deep + std::string(1'000'000, ']') + "}";
  const std::string many_words = "{\"rhand\": {\"poses\": \"" + std::string(1'000'000, 'x') + "\"}}";
  for (const std::string& text : {endless_key, endless_number, deep, deep_and_closed, many_words}) {
    SampleList samples;
    const auto read = read_aframe(text, "hand.json", all, samples);
    ASSERT_FALSE(read);
    EXPECT_LT(read.error().message.size(), 300u);
    EXPECT_TRUE(read.error().message.starts_with("hand.json: ")) << read.error().message;
  }
}

}  // namespace
}  // namespace steadyhand
