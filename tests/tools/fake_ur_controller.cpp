// A Universal Robots controller to try `--arm ur` with, and for tests in Python: the fake one in real time, until a
// signal.
#include "support/ur/fake_ur_controller.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <signal.h>

#include <iostream>

#include "app/command_line.hpp"
#include "config/robot_file.hpp"

int main(int argc, char** argv) {
  using namespace steadyhand;
  FakeUrController::Settings settings;
  std::string robot = "ur5e";
  bool cb3 = false;
  int unplug_ms = 0, lag = 0;
  double every = 0.0;
  CommandLine app("fake_ur_controller", "Pretends to be a Universal Robots controller");
  app.add_option("--address", settings.address, "IPv4 address to listen at")->capture_default_str();
  app.add_option("--rtde-port", settings.rtde_port, "0: any")->capture_default_str();
  app.add_option("--script-port", settings.script_port, "0: any")->capture_default_str();
  app.add_option("--dashboard-port", settings.dashboard_port, "0: any")->capture_default_str();
  app.add_option("--robot", robot, "Its arm")->capture_default_str();
  app.add_option("--protocol", settings.newest_protocol, "Newest RTDE version")->capture_default_str();
  app.add_flag("--cb3", cb3, "125 Hz");
  app.add_option("--unplug-ms", unplug_ms, "Pull the cable for so long ...");
  app.add_option("--every", every, "... every so many seconds");
  app.add_option("--lag", lag, "Send everything so many cycles late");
  const Result<bool> parsed = app.parse(argc, argv);
  if (!parsed) std::cerr << parsed.error().message << "\n";
  if (!parsed || !*parsed) return parsed ? 0 : 2;
  if (cb3) settings.version = {3, 15, 8, 106339};

  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  const auto model = open_robot(robot);
  if (!model) {
    std::cerr << model.error().message << "\n";
    return 2;
  }
  FakeUrController controller(*model, settings);
  if (const Status s = controller.listen(); !s) {
    std::cerr << s.error().message << "\n";
    return 2;
  }
  std::cout << fmt::format("listening at {}: rtde {} script {} dashboard {}\n", settings.address,
                           controller.rtde_port(), controller.script_port(), controller.dashboard_port())
            << std::flush;
  // A controller is a real-time machine; where that is not granted, it is one that stalls at times.
  sched_param priority{};
  priority.sched_priority = 85;
  (void)sched_setscheduler(0, SCHED_FIFO, &priority);
  controller.lag(lag);
  controller.run();
  const timespec wait{every > 0.0 ? static_cast<time_t>(every) : 1, 0};
  while (sigtimedwait(&ends, nullptr, &wait) < 0) {
    if (every > 0.0) controller.unplug(static_cast<int>(1e-3 * unplug_ms / controller.period()));
  }
  controller.stop();
  std::cout << fmt::format(
      "{} cycles without a set-point; largest speed {:.3f} rad/s, largest steps: position {:.4f} mrad, "
      "speed {:.4f} rad/s, largest acceleration {:.2f} rad/s^2; {}\n",
      controller.unanswered(), controller.largest_speed(), 1e3 * controller.largest_position_step(),
      controller.largest_speed_step(), controller.largest_acceleration(),
      controller.last_error().empty() ? "no stop" : "last stop: " + controller.last_error());
}
