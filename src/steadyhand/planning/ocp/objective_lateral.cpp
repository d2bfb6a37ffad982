#include "steadyhand/planning/ocp/liquid_objective.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// w (a_x^2 + a_y^2): g has no x and y.
class Lateral final : public LiquidObjective<0, 1> {
 public:
  Lateral()
      : LiquidObjective({.name = "lateral",
                         .label = "Lateral specific force",
                         .unit = "s^3/m^2",
                         .weights = {1, WeightCount::Of::kTool},
                         .range = {0.01, 20.0, true},
                         .at_rest_min = kAtRest}) {}

 private:
  static constexpr double kAtRest = 10.0;  ///< limits the motion of the liquid while the arm stops
};

}  // namespace

std::shared_ptr<const Objective> make_lateral_objective() { return std::make_shared<Lateral>(); }

}  // namespace steadyhand
