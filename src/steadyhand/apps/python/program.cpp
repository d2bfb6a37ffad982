#include <string>
#include <vector>

#include "steadyhand/apps/commands/run.hpp"
#include "steadyhand/apps/python/module.hpp"
#include "steadyhand/core/configuration.hpp"

namespace steadyhand::python {

namespace {

constexpr const char* kExamples =
    "Examples:\n"
    "  steadyhand replay hand.csv --profile waiter --out results\n"
    "  steadyhand describe ur5e                 the robot as JSON\n"
    "  steadyhand solve problem.json            one planning problem, or an array of them\n"
    "  steadyhand study STUDY.yaml --simulated 24\n"
    "  steadyhand dataset sessions --out set\n"
    "The Python package has these commands; those with an arm or a page are the program's.\n"
    "Exit codes: 0 done; 2 bad input, with the reason on stderr.";

/// The command line's exit code, and why, if it is not 0.
nb::tuple run_program(std::vector<std::string> words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  CommandLine app("steadyhand",
                  "Teleoperation of a robot arm by model predictive control: within its limits, without collisions, "
                  "without spilling a glass.");
  app.version("steadyhand " STEADYHAND_VERSION);
  app.footer(kExamples);
  Command command;
  add_replay_command(app, command);
  add_describe_command(app, command);
  add_solve_command(app, command);
  // Written in Python, which takes these words before they come here (python/steadyhand/__main__.py).
  app.add_subcommand("study",
                     "A user study, by people or simulated operators (needs pip install .[study] in the checkout)");
  app.add_subcommand("dataset", "A data set of recorded sessions (needs pip install .[dataset] in the checkout)");
  app.add_subcommand("score", "Recorded sessions as rows of figures");
  app.add_subcommand("policy", "A policy of a Python file controls the arm of a running program");
  const Result<int> done = [&] {
    const Unlocked unlocked;
    return run(app, command, 0, static_cast<int>(argv.size()), argv.data());
  }();
  return done ? nb::make_tuple(*done, "") : nb::make_tuple(2, done.error().message);
}

}  // namespace

void bind_program(nb::module_& module) { module.def("run_program", &run_program); }

}  // namespace steadyhand::python
