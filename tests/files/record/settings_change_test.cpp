#include "steadyhand/files/record/settings_change.hpp"

#include <gtest/gtest.h>

namespace steadyhand {
namespace {

TEST(Weights, ComeBackFromTheMetadata) {
  const Weights weights{{"lateral", {0.4}}, {"position", {1500.0}}, {"posture", {1.0, 1.0 / 3.0, 2e-300}}};
  EXPECT_EQ(read_weights(weights_text(weights)), weights);
  EXPECT_EQ(weights_text({{"lateral", {0.4}}}), R"({"lateral":[0.4]})");
  EXPECT_EQ(read_weights(weights_text({})), Weights());
}

TEST(Weights, AreReadAsOldVersionsWroteThem) {
  EXPECT_EQ(read_weights("position 1500, acceleration_step 0.001, posture 1 1 2e-3"),
            (Weights{{"position", {1500.0}}, {"acceleration_step", {0.001}}, {"posture", {1.0, 1.0, 2e-3}}}));
}

TEST(Weights, OfWhatIsNeitherThereAreNone) {
  for (const char* text : {"", "not the same throughout", "{", R"({"lateral": 1})", R"({"lateral": ["x"]})", "{}x"})
    EXPECT_EQ(read_weights(text), Weights()) << text;
}

}  // namespace
}  // namespace steadyhand
