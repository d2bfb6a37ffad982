// Prints the plans of this build, for comparison with WebAssembly's (tests/python/test_site.py, web/e2e/plans.mjs):
//   closed_loop SETUP.json PROFILE PROBLEMS   closed_loop() of src/steadyhand/apps/browser/closed_loop.hpp
//   closed_loop SETUP.json --play SECONDS     commands_of()
// SETUP.json is what `steadyhand site-data ROBOT` prints.
#include "steadyhand/apps/browser/closed_loop.hpp"

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>

#include "steadyhand/core/time.hpp"

int main(int argc, char** argv) {
  using namespace steadyhand;
  if (argc != 4) return 2;
  std::ostringstream text;
  text << std::ifstream(argv[1]).rdbuf();
  const Result<BrowserSetup> setup = read_setup_json(text.str());
  if (!setup) return std::cerr << setup.error().message << "\n", 2;
  MonotonicClock clock;
  const bool plays = std::string(argv[2]) == "--play";
  const Result<std::string> answer =
      plays ? commands_of(*setup, std::atof(argv[3]))
            : closed_loop(*setup, std::atoi(argv[2]), std::atoi(argv[3]), [&] { return clock.now(); });
  if (!answer) return std::cerr << answer.error().message << "\n", 2;
  std::cout << *answer << "\n";
}
