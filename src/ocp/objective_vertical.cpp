#include "ocp/liquid.hpp"
#include "ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// w (a_z - g)^2
class Vertical final : public LiquidObjective {
 public:
  Vertical() : LiquidObjective("vertical", {0.0, 0.0, 1.0}) {}
};

}  // namespace

std::unique_ptr<Objective> make_vertical_objective() { return std::make_unique<Vertical>(); }

}  // namespace steadyhand
