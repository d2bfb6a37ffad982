#include "steadyhand/planning/ocp/liquid_objective.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// w (a_z - g)^2
class Vertical final : public LiquidObjective<2> {
 public:
  Vertical()
      : LiquidObjective({.name = "vertical",
                         .label = "Vertical specific force",
                         .unit = "s^3/m^2",
                         .weights = {1, WeightCount::Of::kTool},
                         .range = {0.01, 20.0, true}}) {}
};

}  // namespace

std::shared_ptr<const Objective> make_vertical_objective() { return std::make_shared<Vertical>(); }

}  // namespace steadyhand
