#include <gtest/gtest.h>

#include "planning/plan/loop.hpp"
#include "support/extra_objectives.hpp"

namespace steadyhand {
namespace {

/// Weights of an arm with a fixed target that leave some of its joints' motion free, or are almost 0.
TEST(Planner, StaysAtRestWhateverTheWeightsLeaveFree) {
  using Weights = std::map<std::string, std::vector<double>>;
  const Weights cases[] = {{},
                           {{"orientation", {1}}},
                           {{"orientation", {0, 0, 1}}},
                           {{"position", {5}}},
                           {{"position", {1e6}}, {"velocity", {0, 0, 0, 0.1, 0, 0}}},
                           {{"lateral", {1}}},
                           {{"lateral", {1e6}}},
                           {{"vertical", {1}}},
                           {{"position", {5e-5}}, {"orientation", {5e-7}}, {"velocity", {1e-8}}}};
  for (const unsigned seed : {3u, 4u}) {
    Loop loop(seed);
    loop.arm.set_position(loop.model.home);
    loop.model.tools[0].origin.linear() *= loop.arm.R().transpose();  // upright, where `lateral` and `vertical` want it
    loop.arm = Kinematics(loop.model);
    loop.direction.setZero();
    for (const Weights& weights : cases) {
      // Without `velocity` among a caller's own objectives, too.
      OcpSettings settings = loop.settings;
      settings.weights = weights;
      if (weights.count("velocity") == 0) settings.objectives.erase(settings.objectives.begin() + 2);
      const std::unique_ptr<Planner> planner = std::move(*Planner::make(loop.model, settings, {}));
      double moved = 0.0;
      for (Time now{0}; now < std::chrono::seconds(5); now += std::chrono::milliseconds(50)) {
        const Plan& plan = planner->update(loop.reference(now));
        moved = std::max(moved, (plan.x[0].head(6) - loop.model.home).cwiseAbs().maxCoeff());
      }
      EXPECT_LT(moved, 0.01) << "rad, seed " << seed << ", case " << &weights - cases;
    }
  }
}

TEST(Planner, CountsSoMuchDampingAtLeast) {
  Loop loop(3);
  const auto velocity = [&](const std::map<std::string, std::vector<double>>& weights) {
    loop.planner->set_weights(*loop.planner->ocp().weights(weights));
    return loop.planner->instance().weights[2];
  };
  EXPECT_EQ(velocity({}), JointVector::Constant(6, 0.02));
  EXPECT_EQ(velocity({{"position", {500}}, {"velocity", {0.04}}}), JointVector::Constant(6, 0.04));
  EXPECT_EQ(velocity({{"lateral", {1e6}}, {"velocity", {2, 0, 2, 2, 2, 2}}})[1], 1.0);
  OcpSettings full = test::with_objectives(kMaxObjectives + 1);
  full.objectives.erase(full.objectives.begin() + 2);
  const auto refused = Planner::make(loop.model, full, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message,
            "16 objectives without 'velocity', which the planner adds; it takes 15 others at most");
}

}  // namespace
}  // namespace steadyhand
