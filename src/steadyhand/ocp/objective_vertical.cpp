#include "steadyhand/ocp/liquid.hpp"
#include "steadyhand/ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// w (a_z - g)^2
class Vertical final : public LiquidObjective<2> {
 public:
  Vertical() : LiquidObjective("vertical") {}
};

}  // namespace

std::unique_ptr<Objective> make_vertical_objective() { return std::make_unique<Vertical>(); }

}  // namespace steadyhand
