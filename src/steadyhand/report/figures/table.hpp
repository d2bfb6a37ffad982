#pragma once

#include <span>
#include <string>
#include <vector>

#include "steadyhand/report/figures/metrics.hpp"

namespace steadyhand {

/// One line of the comparison, in the terminal and on the page.
struct MetricRow {
  enum class Best { kNone, kLowest, kHighest };
  const char* group;
  std::string label;
  const char* unit;  ///< of value(); may be empty
  double (*of_tool)(const Metrics&, int tool);
  int decimals;
  Best best;            ///< which profile is best; kNone: profiles are not ranked by it
  const char* meaning;  ///< one sentence
  int tool = 0;         ///< whose value it is, if each has one

  double value(const Metrics& metrics) const { return of_tool(metrics, tool); }
};

/// All rows. @param tools names; of several, each has its rows of glass and tracking
std::vector<MetricRow> metric_rows(std::span<const std::string> tools = {});

/// True if at least one profile has a value; otherwise the row is left out.
bool is_known(const MetricRow& row, std::span<const Metrics> metrics);

/// value(metrics) with the row's decimals; zero has no sign.
std::string format_value(const MetricRow& row, const Metrics& metrics);

}  // namespace steadyhand
