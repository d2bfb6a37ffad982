#include "steadyhand/ocp/liquid.hpp"
#include "steadyhand/ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// w (a_x^2 + a_y^2): g has no x and y.
class Lateral final : public LiquidObjective<0, 1> {
 public:
  Lateral() : LiquidObjective("lateral") {}
};

}  // namespace

std::unique_ptr<Objective> make_lateral_objective() { return std::make_unique<Lateral>(); }

}  // namespace steadyhand
