#include "steadyhand/record/step.hpp"

namespace steadyhand {

std::string_view to_string(PlanOrigin origin) {
  switch (origin) {
    case PlanOrigin::kSolved:
      return "solved";
    case PlanOrigin::kFeasible:
      return "feasible";
    case PlanOrigin::kPrevious:
      return "previous";
  }
  return "unknown";
}

}  // namespace steadyhand
