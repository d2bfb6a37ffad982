#include <gtest/gtest.h>

#include "files/config/refusal.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/planning/ocp/term.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

TEST(Profile, TheThreeProfilesAreThoseOfTheFormulation) {
  struct Expected {
    const char* name;
    double lateral, vertical;
  };
  for (const auto& [name, lateral, vertical] :
       {Expected{"tracking", 0, 0}, Expected{"anti-slosh", 10, 10}, Expected{"waiter", 3, 0.3}}) {
    const auto profile = load_profile(name, kPlaces);
    ASSERT_TRUE(profile) << profile.error().message;
    EXPECT_EQ(profile->name, name);
    EXPECT_EQ(profile->ocp.horizon, 8);
    EXPECT_EQ(profile->ocp.dt, 0.05);
    const std::map<std::string, std::vector<double>> weights{{"position", {500}},    {"orientation", {5}},
                                                             {"velocity", {0.1}},    {"acceleration", {0.02}},
                                                             {"lateral", {lateral}}, {"vertical", {vertical}}};
    EXPECT_EQ(profile->ocp.weights, weights);
    EXPECT_EQ(weights.size(), default_objectives().size());
  }
}

TEST(Profile, ReadsWhatIsThereAndFillsInTheRest) {
  const TemporaryFolder folder;
  const auto file =
      folder.write("own.yaml", "horizon: 12\nweights: {position: [1, 2, 3]}\nlimits: {velocity_scale: 0.5}\n");
  const auto profile = load_profile(file.string(), kPlaces);
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ(profile->name, "own");
  EXPECT_EQ(profile->label, "own");
  EXPECT_EQ(profile->ocp.horizon, 12);
  EXPECT_EQ(profile->ocp.weights.at("position"), (std::vector{1.0, 2.0, 3.0}));
  EXPECT_EQ(profile->ocp.velocity_scale, 0.5);
  EXPECT_EQ(profile->ocp.acceleration_scale, 1.0);
  EXPECT_EQ(profile->solver, kDefaultSolver);
}

TEST(Profile, ALiquidIsReadWithItsMargin) {
  const auto carry = load_profile("carry", kPlaces);
  ASSERT_TRUE(carry) << carry.error().message;
  ASSERT_TRUE(carry->ocp.liquid);
  EXPECT_EQ(carry->tilt_max, 0.0);
  EXPECT_EQ(carry->prediction, Prediction::kDecaying);
  const TemporaryFolder folder;
  const auto own = load_profile(
      folder.write("own.yaml", "tilt: 90\nliquid: {margin: 0.005, lean: 30}\nweights: {position: 1}\n").string(),
      kPlaces);
  ASSERT_TRUE(own) << own.error().message;
  EXPECT_NEAR(own->tilt_max, M_PI / 2, 1e-12);
  EXPECT_EQ(own->ocp.liquid->margin, 0.005);
  EXPECT_NEAR(own->ocp.liquid->lean_max, M_PI / 6, 1e-12);
  EXPECT_FALSE(load_profile("waiter", kPlaces)->ocp.liquid);
}

TEST(Profile, APriorityScalesTheWeightsOfATool) {
  const TemporaryFolder folder;
  const auto weights = [&](const std::string& text) {
    const auto profile = load_profile(folder.write("own.yaml", text).string(), kPlaces);
    EXPECT_TRUE(profile) << profile.error().message;
    return profile ? profile->ocp.weights : Weights();
  };
  const Weights scaled{{"position", {10, 10, 10, 5, 5, 5}}, {"orientation", {1, 2, 3, 2, 2.5, 3}}, {"lateral", {4}}};
  EXPECT_EQ(weights("priority: [1, 0.5]\nweights: {position: 10, orientation: [1, 2, 3, 4, 5, 6], lateral: 4}\n"),
            scaled);
  const auto profile =
      load_profile(folder.write("own.yaml", "priority: [1, 0.5]\nweights: {position: 10}\n").string(), kPlaces);
  RobotModel robot;
  robot.name = "one";
  robot.tools.resize(1);
  EXPECT_EQ(suits(*profile, robot).error().message,
            "profile 'own' has a priority, which needs a robot with two tools; 'one' has one");
  robot.tools.resize(2);
  EXPECT_TRUE(suits(*profile, robot));
}

class ProfileRefuses : public testing::TestWithParam<Refusal> {};

TEST_P(ProfileRefuses, WithTheReason) {
  const TemporaryFolder folder;
  const auto profile = load_profile(folder.write("own.yaml", GetParam().text).string(), kPlaces);
  ASSERT_FALSE(profile);
  EXPECT_NE(profile.error().message.find(GetParam().message), std::string::npos) << profile.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    All, ProfileRefuses,
    testing::Values(
        Refusal{"prediction", "prediction: sideways\nweights: {}\n",
                "own.yaml:1: prediction is 'sideways'; it must be constant_velocity or decaying"},
        Refusal{"priority", "priority: [1, 0]\nweights: {}\n", "own.yaml:1: priority"},
        Refusal{"priority_of_one", "priority: 0.5\nweights: {}\n",
                "own.yaml:1: priority has 1 numbers; 2 are expected, one for each tool"},
        Refusal{"priority_of_nothing", "priority: [1, 0.5]\nweights: {position: []}\n",
                "own.yaml:2: weights.position is an empty list"},
        Refusal{"tilt", "tilt: 190\nweights: {}\n", "own.yaml:1: tilt is 190; it must be at least 0 and at most 180"},
        Refusal{"liquid", "liquid: {frequencies: [1, 2]}\nweights: {}\n",
                "own.yaml:1: liquid.frequencies has 2 numbers; 3 are expected"},
        Refusal{"liquid_price", "liquid: {price: 0}\nweights: {}\n", "own.yaml:1: liquid.price is 0"},
        Refusal{"no_weights", "name: a\n", "own.yaml:1: key 'weights' is missing"},
        Refusal{"unknown_term", "weights:\n  position: 1\n  jerk: 2\n",
                "own.yaml:3: weights.jerk is no term of the problem; known: position, orientation, velocity, "
                "acceleration, lateral, vertical"},
        Refusal{"misspelt_term", "weights: {postion: 1}\n", "did you mean 'position'?"},
        Refusal{"negative", "weights: {lateral: -1}\n", "own.yaml:1: weights.lateral is -1; it must be not negative"},
        Refusal{"negative_in_list", "weights: {position: [1, -2, 3]}\n", "weights.position[1] is -2"},
        Refusal{"nan", "weights: {lateral: nan}\n", "weights.lateral is 'nan'"},
        Refusal{"list_for_scalar_term", "weights: {lateral: [1, 2, 3]}\n",
                "weights.lateral has 3 numbers; one number is"},
        Refusal{"two_for_position", "weights: {position: [1, 2]}\n", "one number or a list of 3 is expected"},
        Refusal{"too_many_joints", "weights: {velocity: [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]}\n",
                "has 17 numbers"},
        Refusal{"horizon", "horizon: 0\nweights: {position: 1}\n", "own.yaml:1: horizon is 0; it must be at least 1"},
        Refusal{"long_horizon", "horizon: 1000\nweights: {position: 1}\n", "at most 128"},
        Refusal{"dt", "dt: 0\nweights: {position: 1}\n", "own.yaml:1: dt is 0; it must be more than 0"},
        Refusal{"solver", "solver: magic\nweights: {position: 1}\n", "solver is 'magic'; the solvers are "},
        Refusal{"scale", "weights: {position: 1}\nlimits: {velocity_scale: 1.5}\n", "limits.velocity_scale is 1.5"},
        Refusal{"name", "name: ../up\nweights: {position: 1}\n", "name is '../up'; a name without '/'"},
        Refusal{"weights_list", "weights: [1, 2]\n", "weights is a list; a mapping"}),
    refusal_name);

TEST(Profile, AnUnknownNameListsTheKnownOnes) {
  const auto profile = load_profile("quick", kPlaces);
  ASSERT_FALSE(profile);
  EXPECT_NE(profile.error().message.find("anti-slosh, carry, follow, tracking, tray, waiter"), std::string::npos)
      << profile.error().message;
  EXPECT_EQ(load_profile("", kPlaces).error().message,
            "profile '' is neither a file nor one of the names in profiles/: anti-slosh, carry, follow, tracking, "
            "tray, waiter");
}

TEST(Profile, AnObjectiveThatIsNullIsRefused) {
  Objectives objectives = default_objectives();
  objectives.push_back(nullptr);
  EXPECT_EQ(load_profile("waiter", kPlaces, objectives).error().message, "objectives: one is null");
}

}  // namespace
}  // namespace steadyhand
