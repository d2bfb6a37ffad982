// The whole way as it runs live: poses of the hand come at 90 Hz, commands go to the arm at 500 Hz, and a Pipeline
// plans in between. Here the hand goes round in a circle, and the clock is a counter.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "steadyhand/files.hpp"
#include "steadyhand/geometry.hpp"

using namespace steadyhand;

int main() {
  const auto made = open_pipeline("ur5e", "tracking");
  if (!made) {
    fmt::print(stderr, "{}\n", made.error().message);
    return 2;
  }
  Pipeline& arm = **made;
  const RobotModel& ur5e = arm.model();

  const auto circle = [](Time t) {  // radius 0.2 m, 4 s for a turn
    const double angle = 2.0 * M_PI * to_seconds(t) / 4.0;
    return Pose{0.2 * Vector3(0.0, std::sin(angle), 1.0 - std::cos(angle)), Quaternion::Identity()};
  };
  const Time command_period = from_seconds(1.0 / 500.0), hand_period = from_seconds(1.0 / 90.0),
             end = from_seconds(8.0);
  Kinematics kinematics(ur5e);
  Time next_hand{0};
  double worst_error = 0.0, worst_speed = 0.0, smallest_gap = 1.0;
  for (Time now{0}; now < end; now += command_period) {
    for (; next_hand <= now; next_hand += hand_period) {
      if (Status s = arm.feed({{next_hand, next_hand}, circle(next_hand), true}); !s) return 1;
    }
    const JointCommand command = arm.update(now);  // what a real arm would be sent

    kinematics.set_position(command.q);
    smallest_gap = std::min(smallest_gap, clearance(kinematics));
    worst_speed = std::max(worst_speed, (command.dq.cwiseAbs().array() / ur5e.velocity_max.array()).maxCoeff());
    const double error = (kinematics.p() - arm.target().X_base_tool.p).norm();
    if (now > from_seconds(1.0)) worst_error = std::max(worst_error, error);
  }
  fmt::print("farthest from where the hand wants the glass, after 1 s: {:.1f} mm\n", 1e3 * worst_error);
  fmt::print("fastest joint: {:.0f} % of its limit; smallest clearance: {:.1f} mm\n", 100.0 * worst_speed,
             1e3 * smallest_gap);
  return worst_error < 0.02 && worst_speed <= 1.0 && smallest_gap > 0.0 ? 0 : 1;
}
