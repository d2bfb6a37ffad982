// A Universal Robots controller to try `--arm ur` with, and for tests in Python: the fake one in real time, until a
// signal. Lines on its standard input are an operator's actions at its pendant (FakeUrController::ask).
#include "support/ur/fake_ur_controller.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <iostream>

#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/files/config/open.hpp"
#include "support/ur/ur5e_kinematics.hpp"

int main(int argc, char** argv) {
  using namespace steadyhand;
  FakeUrController::Settings settings;
  std::string robot = "ur5e";
  bool calibrated = false, cb3 = false, polyscope_x = false, local = false, stopped = false;
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
  app.add_flag("--polyscope-x", polyscope_x, "Software 10.12: a Robot API over HTTP at the dashboard's port");
  app.add_flag("--calibrated", calibrated, "Its kinematics differs from the robot file's by some mm");
  app.add_flag("--local", local, "Not in remote control");
  app.add_flag("--stopped", stopped, "Its program is stopped; after switching on it is paused");
  app.add_option("--servo-lag", settings.servo_lag, "Of servoj, s")->capture_default_str();
  app.add_option("--budget", settings.budget, "Of its interpreter; 0: none")->capture_default_str();
  app.add_option("--payload", settings.payload, "Set at the pendant, kg")->capture_default_str();
  app.add_option("--unplug-ms", unplug_ms, "Pull the cable for so long ...");
  app.add_option("--every", every, "... every so many seconds");
  app.add_option("--lag", lag, "Send everything so many cycles late");
  const Result<bool> parsed = app.parse(argc, argv);
  if (!parsed) std::cerr << parsed.error().message << "\n";
  if (!parsed || !*parsed) return parsed ? 0 : 2;
  if (cb3) settings.version = {3, 15, 8, 106339};
  if (polyscope_x) settings.version = {10, 12, 0, 1};
  settings.remote_control = !local;
  settings.paused = !stopped;

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
  if (robot == "ur5e") settings.kinematics = ur5e_kinematics();
  if (settings.kinematics && calibrated) {  // as factories measure them
    settings.kinematics->d[2] += 2e-3;
    settings.kinematics->a[1] -= 1e-3;
    settings.kinematics->theta[3] += 1e-3;
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
  constexpr timespec kNoTime{};
  pollfd lines{STDIN_FILENO, POLLIN, 0};
  std::string said;
  MonotonicClock clock;
  Time unplugged = clock.now();
  while (sigtimedwait(&ends, nullptr, &kNoTime) < 0) {
    if (every > 0.0 && clock.now() - unplugged > from_seconds(every)) {
      unplugged = clock.now();
      controller.unplug(static_cast<int>(1e-3 * unplug_ms / controller.period()));
    }
    if (poll(&lines, 1, 50) <= 0) continue;
    char bytes[256];
    const ssize_t n = read(STDIN_FILENO, bytes, sizeof(bytes));
    if (n <= 0) lines.fd = -1;  // no more input
    said.append(bytes, static_cast<std::size_t>(std::max<ssize_t>(0, n)));
    for (std::size_t end; (end = said.find('\n')) != std::string::npos; said.erase(0, end + 1)) {
      const std::string what = said.substr(0, end);
      std::cout << (controller.ask(what) ? "done: " : "unknown: ") << what << "\n" << std::flush;
    }
  }
  controller.stop();
  std::cout << fmt::format(
      "{} cycles without a set-point; largest speed {:.3f} rad/s, largest steps: position {:.4f} mrad, "
      "speed {:.4f} rad/s, largest acceleration {:.2f} rad/s^2; the interpreter evaluates up to {} in a cycle, {} "
      "cycles lost; "
      "{}\n",
      controller.unanswered(), controller.largest_speed(), 1e3 * controller.largest_position_step(),
      controller.largest_speed_step(), controller.largest_acceleration(), controller.largest_effort(),
      controller.overruns(), controller.last_error().empty() ? "no stop" : "last stop: " + controller.last_error());
}
