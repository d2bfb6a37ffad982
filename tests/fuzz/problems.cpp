// Optimal control problems as JSON.
#include "fuzz/fuzz.hpp"
#include "steadyhand/files/record/problem_json.hpp"

namespace steadyhand {

FUZZ(problems) {
  const Result<ProblemFile> file = read_problems(fuzz::as_file(input));
  if (!file) return fuzz::require(!file.error().message.empty(), "a refusal says why");
  for (const ProblemRecord& problem : file->problems) {
    fuzz::require(problem.x0.allFinite() && problem.dt > 0.0 && problem.horizon >= 1, "a problem");
    fuzz::require(problem.reference.nodes == problem.horizon, "its reference");
  }
}

}  // namespace steadyhand
