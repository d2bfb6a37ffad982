#pragma once

#include <string>

#include "steadyhand/report/figures/report.hpp"

namespace steadyhand {

/// Plans, and commands, that one point of a curve on the page stands for.
struct Thinning {
  int steps_per_point = 1;
  int commands_per_point = 1;  ///< entries of ProfileResult::commands
};

/// How much `input` must be thinned for a page that stays quick.
Thinning choose_thinning(const ReportInput& input);

/// All that the page shows as JSON, curves in its units; web/src/report/data.ts says how it is laid out.
/// Contains no '<', so it can stand inside a script element.
std::string page_data(const ReportInput& input, const Thinning& thinning);

}  // namespace steadyhand
