// A ROS 2 joint trajectory controller with the simulated arm behind it, to try `--arm ros2` with, and for tests in
// Python: in real time, until a signal.
#include "support/ros2/reference_controller.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <signal.h>

#include <iostream>

#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/files/config/open.hpp"

int main(int argc, char** argv) {
  using namespace steadyhand;
  ReferenceController::Settings settings;
  std::string robot = "ur5e";
  settings.domain = -1;
  int unplug_ms = 0, lag = 0;
  double every = 0.0, scale = 1.0;
  bool in_order = false;
  CommandLine app("reference_controller", "Pretends to be a ROS 2 machine with a joint trajectory controller");
  app.add_option("--domain", settings.domain, "Of ROS 2; -1: ROS_DOMAIN_ID, else 0")->capture_default_str();
  app.add_option("--controller", settings.controller, "Its node")->capture_default_str();
  app.add_option("--joint-states", settings.joint_states, "Topic")->capture_default_str();
  app.add_option("--prefix", settings.prefix, "Of the joints' names");
  app.add_option("--robot", robot, "Its arm")->capture_default_str();
  app.add_option("--rate", settings.rate_hz, "Of its cycles, Hz")->capture_default_str()->within(20.0, 500.0);
  app.add_flag("--in-order", in_order, "Joint states name the joints from the base on; else the other way round");
  app.add_option("--unplug-ms", unplug_ms, "Lose everything for so long ...");
  app.add_option("--every", every, "... every so many seconds");
  app.add_option("--lag", lag, "Send and take everything so many cycles late");
  bool inactive = false;
  double frozen_ms = 0.0;
  app.add_flag("--inactive", inactive, "The controller is loaded, not active");
  app.add_option("--servo-lag", settings.servo_lag, "Of the arm, s")->capture_default_str();
  app.add_option("--speed-scaling", settings.speed_scaling, "Topic that tells how fast trajectories are executed");
  app.add_option("--scale", scale, "Execute trajectories at that share of their speed")->capture_default_str();
  app.add_option("--freeze-ms", frozen_ms, "Stand still for so long ...");
  JointTrajectoryController::Settings& parameters = settings.parameters;
  app.add_flag("--interpolate-from-desired-state", parameters.interpolate_from_desired_state, "Parameter of that name");
  app.add_flag("--allow-trajectory-replacement", parameters.allow_trajectory_replacement, "Parameter of that name");
  app.add_option("--trajectory-tolerance", parameters.trajectory, "On the way, rad; 0: any");
  app.add_option("--goal-tolerance", parameters.goal, "At the end, rad; 0: any");
  app.add_option("--goal-time", parameters.goal_time, "After which it must be there, s; 0: no end to the waiting");
  const Result<bool> parsed = app.parse(argc, argv);
  if (!parsed) std::cerr << parsed.error().message << "\n";
  if (!parsed || !*parsed) return parsed ? 0 : 2;
  settings.permuted = !in_order;
  settings.active = !inactive;

  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  const auto fail = [](const Error& error) {
    std::cerr << error.message << "\n";
    return 2;
  };
  const auto domain = ros2_domain(settings.domain);
  if (!domain) return fail(domain.error());
  settings.domain = *domain;
  const auto model = open_robot(robot);
  if (!model) return fail(model.error());
  // A controller is a real-time machine; where that is not granted, it is one that stalls at times.
  sched_param priority{};
  priority.sched_priority = 85;
  (void)sched_setscheduler(0, SCHED_FIFO, &priority);
  const auto made = ReferenceController::make(*model, model->home, settings);
  if (!made) return fail(made.error());
  ReferenceController& controller = **made;
  std::cout << fmt::format("ready in domain {}: {}/joint_trajectory, {}\n", settings.domain, settings.controller,
                           settings.joint_states)
            << std::flush;
  controller.lag(lag);
  controller.scale(scale);
  controller.run();
  const timespec wait{every > 0.0 ? static_cast<time_t>(every) : 1, 0};
  while (sigtimedwait(&ends, nullptr, &wait) < 0) {
    if (every > 0.0) controller.unplug(static_cast<int>(1e-3 * unplug_ms / controller.period()));
    if (every > 0.0) controller.freeze(static_cast<int>(1e-3 * frozen_ms / controller.period()));
  }
  controller.stop();
  const ReferenceController::Largest& largest = controller.largest();
  std::cout << fmt::format(
      "{} trajectories, {} lost or late, {} refused{}; largest speed {:.3f} rad/s, "
      "largest steps: position {:.4f} mrad, speed {:.4f} rad/s, largest acceleration {:.2f} rad/s^2; {}\n",
      controller.accepted() + controller.refused(), controller.lost(), controller.refused(),
      controller.refused() > 0 ? " (" + controller.last_refusal() + ")" : "", largest.q / controller.period(),
      1e3 * largest.position_step, largest.speed_step, largest.ddq,
      controller.last_stop().empty() ? "no stop" : "last stop: " + controller.last_stop());
}
