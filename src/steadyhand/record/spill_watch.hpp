#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "steadyhand/arm/liquid.hpp"
#include "steadyhand/core/time.hpp"

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

/// Each time that the liquid went over the rim. Seen from every measurement, so that report and replay, which keep
/// fewer of them, tell the same.
class SpillLog {
 public:
  struct Spill {
    Time at{0};
    double share = 0.0;              ///< of the liquid, until the glass was full again
    double lateral = 0.0;            ///< m/s^2, the largest sideways force in the half second before; 0: not recorded
    std::optional<Time> full_again;  ///< absent: not in this session
  };

  /// In the order of time.
  void see(Time at, const LiquidState& liquid) {
    if (std::isfinite(liquid.lateral)) felt_.emplace_back(at, liquid.lateral);
    while (!felt_.empty() && to_seconds(at - felt_.front().first) > kBefore) felt_.pop_front();
    const std::optional<double> lost = watch_.see(liquid);
    if (lost && !spilled_) {
      Spill& begun = spills_.emplace_back();
      begun.at = at;
      for (const auto& [when, lateral] : felt_) begun.lateral = std::max(begun.lateral, lateral);
    }
    if (lost) spills_.back().share = std::max(spills_.back().share, *lost);
    if (spilled_ && !lost) spills_.back().full_again = at;
    spilled_ = lost.has_value();
  }
  const std::vector<Spill>& spills() const { return spills_; }

 private:
  static constexpr double kBefore = 0.5;  ///< s, in which the liquid was pushed over the rim
  SpillWatch watch_;
  std::vector<Spill> spills_;
  std::deque<std::pair<Time, double>> felt_;
  bool spilled_ = false;
};

}  // namespace steadyhand
