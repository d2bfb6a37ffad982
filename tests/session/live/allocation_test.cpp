#include <optional>

#include "support/allocation_guard.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

/// Through engaging, following, releasing, changing planners, stopping and resetting.
TEST(HotPath, ControlAndPlannerStepsDoNotAllocate) {
  VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
  OcpSettings other = load_profile("carry")->ocp;
  other.horizon = 5;
  options.more = {{other}};
  VirtualSession session(options);
  session.lead(sweeping({0.1, 0.15, 0.1}));
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
  ASSERT_TRUE(session.grip());
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

}  // namespace
}  // namespace steadyhand
