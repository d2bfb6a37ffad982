#pragma once

#include <string>

#include "steadyhand/report/figures/report.hpp"

namespace steadyhand {

/// How many plans, and commands, one point of a curve on the page represents.
struct Thinning {
  int steps_per_point = 1;
  int commands_per_point = 1;  ///< entries of ProfileResult::commands
};

/// Thinning of `input` that keeps the page fast.
Thinning choose_thinning(const ReportInput& input);

/// Everything the page shows, as JSON, with curves in their units; the format is in web/src/report/data.ts. Contains no
/// '<', so it can be embedded in a script element.
std::string page_data(const ReportInput& input, const Thinning& thinning);

}  // namespace steadyhand
