/// `bench_sqp_hpipm problems.json`: as `steadyhand solve`, by the peer of sqp_hpipm.hpp.
#include <iostream>

#include "sqp_hpipm.hpp"
#include "steadyhand/report/replay/solve_problems.hpp"

int main(int argc, char** argv) {
  using namespace steadyhand;
  if (argc != 2) {
    std::cerr << "usage: bench_sqp_hpipm PROBLEMS.json\n";
    return 2;
  }
  const auto file = read_problems(argv[1]);
  const auto answer =
      !file ? Result<std::string>(file.error()) : solve_problems(*file, argv[1], [](const Ocp& ocp, double tolerance) {
        return Result<std::unique_ptr<Solver>>(bench::make_sqp_hpipm(ocp, tolerance));
      });
  if (!answer) {
    std::cerr << answer.error().message << "\n";
    return 2;
  }
  std::cout << *answer << "\n";
}
