#include <optional>

#include "support/allocation_guard.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

/// Through engaging, following, releasing, changing planners, stopping and resetting.
void expect_no_allocations(const RobotModel& model) {
  VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
  options.model = &model;
  OcpSettings other = load_profile("carry")->ocp;
  other.horizon = 5;
  options.more = {{other}};
  VirtualSession session(options);
  const bool two = model.tool_count() > 1;
  session.second_hand = sweeping({0.1, 0.15, 0.1}, 2.5);
  session.lead(sweeping({0.1, 0.15, 0.1}));
  if (two) ASSERT_TRUE(session.grip(1));
  session.run(1.0);  // a solver may take memory at its first solves
  std::optional<AllocationGuard> guard;
  std::size_t control = 0, planner = 0, steps = 0;
  const auto count = [&](std::size_t& total) {
    return [&](bool begins) {
      if (begins) {
        guard.emplace();
        return;
      }
      total += guard->count();
      guard.reset();
      ++steps;
    };
  };
  session.around_control = count(control);
  session.around_planner = count(planner);
  session.run(1.0);
  session.clutch = false;
  session.run(1.0);
  session.second_clutch = false;
  session.run(1.0);
  ASSERT_TRUE(session.grip());
  if (two) ASSERT_TRUE(session.grip(1));
  session.run(0.5);
  OperatorSettings settings;
  settings.planner = 1;
  session.set(settings);
  session.run(1.0);
  ASSERT_TRUE(session.grip());
  session.run(0.5);
  EXPECT_EQ(session.planner_view.reference.nodes, other.horizon);
  session.ask_stop();
  session.run(1.0);
  session.ask_reset();
  session.run(0.5);
  EXPECT_EQ(session.state(), SupervisionState::kReady);
  EXPECT_GT(steps, 1500u);
  EXPECT_EQ(control, 0u);
  EXPECT_EQ(planner, 0u);
}

TEST(HotPath, ControlAndPlannerStepsDoNotAllocate) { expect_no_allocations(ur5e()); }

TEST(HotPath, NorDoThoseOfTwoArms) {
  const Result<RobotModel> model = open_robot("two_ur5e");
  ASSERT_TRUE(model) << model.error().message;
  expect_no_allocations(*model);
}

}  // namespace
}  // namespace steadyhand
