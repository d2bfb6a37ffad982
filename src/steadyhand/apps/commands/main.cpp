#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <map>
#include <set>
#include <string>

#include "steadyhand/apps/commands/run.hpp"
#include "steadyhand/apps/commands/version.hpp"
#include "steadyhand/operator/console/output_queue.hpp"

namespace {

constexpr int kBadInput = 2;

constexpr const char* kExamples =
    "Examples:\n"
    "  steadyhand demo --headless --seconds 60  a simulated arm follows a recorded hand, live\n"
    "  steadyhand config                        the settings of a live session, with unit and origin\n"
    "  steadyhand check --host 192.168.0.10     test machine and network for this arm; the arm does not move\n"
    "  steadyhand replay                        a bundled hand, under three profiles, with a report\n"
    "  steadyhand replay hand.csv --profile waiter --scale 0.5 --out results\n"
    "  steadyhand replay mocap.json --track rhand --rate 40\n"
    "  steadyhand report SESSION.mcap           report of a session; without a session, a list of sessions\n"
    "  steadyhand describe ur5e                 the robot as JSON\n"
    "  steadyhand describe my_arm.urdf --pretty\n"
    "  steadyhand fit my_arm.urdf --out my_arm.yaml   bodies that cover its meshes, as a robot file\n"
    "  steadyhand solve problem.json            one planning problem, or an array of them\n"
    "  steadyhand tasks stack --episodes 100    a scripted operator does tasks in a scene with contact\n"
    "  steadyhand study STUDY.yaml              a user study, with people or simulated operators\n"
    "  steadyhand dataset SESSION... --out DIR  make a data set for imitation learning from recorded sessions\n"
    "  steadyhand score SESSION...              recorded sessions as rows of figures\n"
    "  steadyhand policy FILE.py:CLASS          a policy controls the arm of a running program\n"
    "In a checkout type ./steadyhand, which installs and builds what a command takes. Only there: bench, deb, docs, "
    "format, python, release, site, test, wheel.\n"
    "Exit codes: 0 done; 1 check: not fit, demo --headless: the arm was stopped; 2 bad input, with the reason on "
    "stderr.";

/// Commands that this build leaves out, by the part of CMake's STEADYHAND_WITH_... that they belong to.
const std::map<std::string, std::string> kLeftOut = {
#ifndef STEADYHAND_UR
    {"check", "UR"},
#endif
#ifndef STEADYHAND_FIT
    {"fit", "FIT"},
#endif
#ifndef STEADYHAND_MUJOCO
    {"tasks", "MUJOCO"},
#endif
};

/// Commands of the Python package (python/steadyhand/__main__.py).
const std::set<std::string> kPython = {"dataset", "policy", "score", "study"};

/// Opens the standard descriptors that are closed at the start. Otherwise the next file opened would get their number,
/// and a recording would get messages meant for people. Reading and writing them fails as if they were closed.
void keep_standard_descriptors() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) >= 0) continue;
    (void)open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);  // the lowest number that is free
  }
}

int fail(const std::string& message) {
  steadyhand::OutputQueue(STDERR_FILENO).say("steadyhand: " + message + "\n");  // ends even if no process reads it
  return kBadInput;
}

}  // namespace

int main(int argc, char** argv) {
  keep_standard_descriptors();
  steadyhand::CommandLine app("steadyhand",
                              "Teleoperation of a robot arm by model predictive control: within its limits, without "
                              "collisions, without spilling a glass.");
  app.version(steadyhand::version_text());
  app.footer(kExamples);
  steadyhand::Command command;
  int exit_code = 0;
  steadyhand::add_demo_command(app, command, exit_code);
#ifdef STEADYHAND_UR
  steadyhand::add_check_command(app, command, exit_code);
#endif
  steadyhand::add_config_command(app, command);
#ifdef STEADYHAND_MUJOCO
  steadyhand::add_tasks_command(app, command);
#endif
  steadyhand::add_replay_command(app, command);
  steadyhand::add_report_command(app, command);
  steadyhand::add_describe_command(app, command);
#ifdef STEADYHAND_FIT
  steadyhand::add_fit_command(app, command);
#endif
  steadyhand::add_solve_command(app, command);
  steadyhand::add_site_data_command(app, command);
  if (argc > 1 && kPython.contains(argv[1]))
    return fail(fmt::format("'{}' is written in Python: the wheel has it, or ./steadyhand in a checkout", argv[1]));
  const auto left_out = argc > 1 ? kLeftOut.find(argv[1]) : kLeftOut.end();
  if (left_out != kLeftOut.end()) {
    const auto& [name, part] = *left_out;
    return fail("this program was built without '" + name + "': build again with -DSTEADYHAND_WITH_" + part +
                "=ON, which ./steadyhand " + name + " does");
  }
  const steadyhand::Result<int> done = steadyhand::run(app, command, exit_code, argc, argv);
  return done ? *done : fail(done.error().message);
}
