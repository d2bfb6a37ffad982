#pragma once

#include <span>
#include <string>

#include "steadyhand/report/figures/metrics.hpp"

namespace steadyhand {

/// One line of the comparison, in the terminal and on the page.
struct MetricRow {
  enum class Best { kNone, kLowest, kHighest };
  const char* group;
  const char* label;
  const char* unit;  ///< of value(); may be empty
  double (*value)(const Metrics&);
  int decimals;
  Best best;            ///< which profile is best; kNone: profiles are not ranked by it
  const char* meaning;  ///< one sentence
};

std::span<const MetricRow> metric_rows();

/// True if at least one profile has a value; otherwise the row is left out.
bool is_known(const MetricRow& row, std::span<const Metrics> metrics);

/// value(metrics) with the row's decimals; zero has no sign.
std::string format_value(const MetricRow& row, const Metrics& metrics);

}  // namespace steadyhand
