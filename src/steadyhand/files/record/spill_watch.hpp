#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"

namespace steadyhand {

/// What spills while one watches: what a glass had lost before is none of it, unless it is full again or loses more.
class SpillWatch {
 public:
  /// Share of the liquid that was lost in sight since the glass was full; absent: none. In the order of time.
  std::optional<double> see(const LiquidState& liquid) {
    constexpr double kMore = 0.005;  // share of the liquid by which an older spill may grow unnoticed
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
/// fewer of them, report the same.
class SpillLog {
 public:
  struct Spill {
    Time at{0};
    std::string profile;             ///< in force; each has what was lost while it was
    Time lost{0};                    ///< by when all of that share was gone
    double share = 0.0;              ///< liquid lost until the glass was full again or the profile changed
    double lateral = 0.0;            ///< m/s^2, largest lateral specific force in the 0.5 s before; 0: not recorded
    double lateral_until = 0.0;      ///< the same until all of that share was gone
    std::optional<Time> full_again;  ///< absent: not in this session
  };

  /// In the order of time. @param profile in force; empty: unknown
  void see(Time at, const LiquidState& liquid, std::string_view profile = {}) {
    if (std::isfinite(liquid.lateral)) felt_.emplace_back(at, liquid.lateral);
    while (!felt_.empty() && to_seconds(at - felt_.front().first) > kBefore) felt_.pop_front();
    const std::optional<double> lost = watch_.see(liquid);
    if (lost && !spilled_) begin(at, profile, 0.0);
    if (lost && spills_.back().profile.empty()) spills_.back().profile = profile;
    if (lost && profile != spills_.back().profile && *lost > booked_ + kMore) begin(at, profile, booked_);
    if (lost && profile == spills_.back().profile && *lost > booked_) {
      booked_ = *lost;
      spills_.back().share = booked_ - before_;
      if (booked_ > told_ + kMore) {
        spills_.back().lost = at;
        for (const auto& [when, lateral] : felt_) {
          spills_.back().lateral_until = std::max(spills_.back().lateral_until, lateral);
        }
        told_ = booked_;
      }
    }
    if (spilled_ && !lost) spills_.back().full_again = at;
    spilled_ = lost.has_value();
  }
  const std::vector<Spill>& spills() const { return spills_; }

 private:
  static constexpr double kBefore = 0.5;  ///< s, in which the liquid was pushed over the rim
  static constexpr double kMore = 5e-4;   ///< share of the liquid that another profile must lose to be named

  void begin(Time at, std::string_view profile, double before) {
    Spill& begun = spills_.emplace_back();
    begun.at = begun.lost = at;
    begun.profile = profile;
    for (const auto& [when, lateral] : felt_) begun.lateral = std::max(begun.lateral, lateral);
    before_ = booked_ = told_ = before;
  }

  SpillWatch watch_;
  std::vector<Spill> spills_;
  std::deque<std::pair<Time, double>> felt_;
  double before_ = 0.0;  ///< share that was lost under earlier profiles
  double booked_ = 0.0;  ///< share that was lost under all
  double told_ = 0.0;    ///< `booked_` when `lost` was set
  bool spilled_ = false;
};

/// Of all tools, in the order of time.
inline std::vector<SpillLog::Spill> spills_of(const PerTool<SpillLog>& liquids) {
  std::vector<SpillLog::Spill> all;
  for (const SpillLog& liquid : liquids) all.insert(all.end(), liquid.spills().begin(), liquid.spills().end());
  std::ranges::stable_sort(all, {}, &SpillLog::Spill::at);
  return all;
}
/// That lost most; null: none.
inline const SpillLog::Spill* worst_of(const std::vector<SpillLog::Spill>& spills) {
  const auto most = std::ranges::max_element(spills, {}, &SpillLog::Spill::share);
  return most == spills.end() ? nullptr : &*most;
}

}  // namespace steadyhand
