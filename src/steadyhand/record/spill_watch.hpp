#pragma once

#include <optional>

#include "steadyhand/arm/liquid.hpp"

namespace steadyhand {

/// What spills while one watches: what a glass had lost before is none of it, unless it is full again or loses more.
class SpillWatch {
 public:
  /// Share of the liquid that was lost in sight since the glass was full; absent: none. In the order of time.
  std::optional<double> see(const LiquidState& liquid) {
    constexpr double kMore = 0.005;  // of the liquid, that an older spill goes on by unnoticed
    if (!watches_ && liquid.spilled) before_ = liquid.spilled_share;
    watches_ = true;
    if (!liquid.spilled) before_.reset();
    if (!liquid.spilled || (before_ && liquid.spilled_share <= *before_ + kMore)) return std::nullopt;
    return liquid.spilled_share - before_.value_or(0.0);
  }

 private:
  bool watches_ = false;
  std::optional<double> before_;  ///< share that was lost out of sight
};

}  // namespace steadyhand
