#include "steadyhand/report/figures/motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "steadyhand/report/figures/metrics.hpp"
#include "steadyhand/report/figures/session_story.hpp"

namespace steadyhand {

namespace {

using Json = nlohmann::json;

std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// Members of a JSON object, each a list with one entry per row; the first list has the rows' times. Written as text:
/// for a session of hours a tree would have millions of nodes.
class Columns {
 public:
  template <typename... Names>
  explicit Columns(Names... names) : names_{names...}, lists_(sizeof...(names)) {}
  void begin_row(double t) { add_row(t, 4); }
  /// Begins a row with any value.
  void add_row(double value, int decimals) {
    column_ = 0;
    add(value, decimals);
  }
  /// Writes null for values that are not finite.
  void add(double value, int decimals) {
    separate();
    std::string& list = lists_[column_++];
    std::isfinite(value) ? (void)fmt::format_to(std::back_inserter(list), "{:.{}f}", value, decimals)
                         : (void)list.append("null");
  }
  template <typename List>
  void add_list(const List& values, int decimals) {
    separate();
    std::string& list = lists_[column_++];
    list += '[';
    for (int i = 0; i < static_cast<int>(values.size()); ++i) {
      fmt::format_to(std::back_inserter(list), "{}{:.{}f}", i > 0 ? "," : "", values[i], decimals);
    }
    list += ']';
  }
  std::string json() const {
    std::string text;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      text += fmt::format("{}\"{}\":[{}]", i > 0 ? "," : "", names_[i], lists_[i]);
    }
    return text;
  }

 private:
  void separate() {
    if (!lists_[column_].empty()) lists_[column_] += ',';
  }

  std::vector<std::string> names_, lists_;
  std::size_t column_ = 0;
};

/// Profile, scale and fill, with the time from which each was in force.
std::string settings_of(const SessionFile& session) {
  Json settings = Json::array();
  for (const SettingsChange& change : session.settings) {
    const std::string profile = change.profile.empty() ? session.run("profile") : change.profile;
    if (!settings.empty() && settings.back()["profile"] == profile && settings.back()["scale"] == change.scale &&
        settings.back()["fill"] == change.fill.value_or(0.0)) {
      continue;
    }
    settings.push_back({{"t_s", to_seconds(change.at)},
                        {"profile", profile},
                        {"scale", change.scale},
                        {"fill", change.fill.value_or(0.0)}});
  }
  return dump(settings);
}

std::string events_of(const SessionFile& session) {
  Json events = Json::array();
  for (const SessionStory::Event& event : tell_story(session).events) {
    events.push_back({{"t_s", event.t_s}, {"kind", event.kind}, {"what", event.what}, {"why", event.why}});
    if (event.amount > 0.0) events.back()["amount"] = event.amount;
  }
  return dump(events);
}

/// Lateral specific force on the liquid while engaged, counted as in the report; null: not measured.
std::string slosh_of(const SessionFile& session, int tool) {
  std::vector<Felt> felt;
  for (const auto& each : felt_while_led(session, tool)) felt.push_back({each.sum, each.largest, each.count});
  if (felt.empty()) return "null";
  ToolMetrics metrics;
  count_felt(felt, metrics);
  return dump({{"mean", metrics.lateral_mean}, {"largest", metrics.lateral_max}});
}

/// mm, mean tracking error over all engaged steps, as the report has it for each setting; null: never engaged.
std::string off_target_of(const SessionFile& session, int tool) {
  const double mean = mean_position_error(session.steps, tool);
  return std::isnan(mean) ? "null" : dump(1e3 * mean);
}

/// The entries, `most` groups of neighbours at most.
template <typename Entry>
std::vector<std::span<const Entry>> grouped(const std::vector<Entry>& entries, std::size_t most) {
  std::vector<std::span<const Entry>> groups;
  const std::size_t each = entries.empty() ? 1 : (entries.size() - 1) / most + 1;
  for (std::size_t i = 0; i < entries.size(); i += each) {
    groups.push_back(std::span(entries).subspan(i, std::min(each, entries.size() - i)));
  }
  return groups;
}

std::string arm_of(const SessionFile& session, std::size_t most_rows) {
  Columns arm("t_s", "q");
  for (const auto states : grouped(session.states, most_rows)) {
    const JointState& state = states.front();
    if (!state.q.allFinite()) continue;  // JSON has no NaN
    arm.begin_row(to_seconds(state.stamp.made));
    arm.add_list(state.q, 5);
  }
  return arm.json();
}

/// At the times of arm_of().
std::string gripper_of(const SessionFile& session, int tool, std::size_t most_rows) {
  Columns gripper("gripper");
  for (const auto states : grouped(session.states, most_rows)) {
    if (states.front().q.allFinite()) gripper.add_row(states.front().gripper[tool].value_or(std::nan("")), 2);
  }
  return gripper.json();
}

std::string target_of(const SessionFile& session, int tool, double period, std::size_t most_rows) {
  std::vector<const PlanStep*> steps;
  for (const PlanStep& step : session.steps) {
    const Pose& target = step.tools[tool].X_base_target;
    if (!steps.empty() && step.t_s - steps.back()->t_s < period - 1e-9) continue;
    if (target.p.allFinite() && target.q.coeffs().allFinite()) steps.push_back(&step);
  }
  Columns hand("t_s", "p", "q", "engaged", "lateral", "error_mm");
  for (const auto group : grouped(steps, most_rows)) {
    const ToolStep& step = group.front()->tools[tool];
    double lateral = std::nan(""), error = std::nan("");
    for (const PlanStep* all : group) {
      const ToolStep& each = all->tools[tool];
      lateral = std::fmax(lateral, lateral_acceleration(each));
      if (each.engaged) error = std::fmax(error, 1e3 * position_error(each));
    }
    hand.begin_row(group.front()->t_s);
    hand.add_list(step.X_base_target.p, 4);
    hand.add_list(step.X_base_target.q.coeffs(), 4);
    hand.add(step.engaged ? 1.0 : 0.0, 0);
    hand.add(lateral, 3);
    hand.add(error, 1);
  }
  return hand.json();
}

std::string felt_of(const SessionFile::Liquid& liquid, std::size_t most_rows) {
  Columns felt("t_s", "mean", "largest", "count");
  for (const auto group : grouped(liquid.felt, most_rows)) {
    SessionFile::Felt all = group.front();
    for (const SessionFile::Felt& each : group.subspan(1)) {
      all.sum += each.sum;
      all.count += each.count;
      all.largest = std::max(all.largest, each.largest);
    }
    felt.begin_row(to_seconds(all.at));
    felt.add(all.mean(), 3);
    felt.add(all.largest, 3);
    felt.add(all.count, 0);
  }
  return felt.json();
}

std::string liquid_of(const SessionFile::Liquid& of, std::size_t most_rows) {
  Columns liquid("t_s", "tilt", "freeboard_mm", "spilled", "spilled_share");
  auto wave = of.waves.begin();
  const auto groups = grouped(of.states, most_rows);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const auto& [at, state] = groups[i].front();
    double freeboard = state.freeboard, share = state.spilled_share;
    for (const auto& [t, each] : groups[i]) share = std::max(share, each.spilled_share);
    for (; wave != of.waves.end() && (i + 1 == groups.size() || wave->at < groups[i + 1].front().first); ++wave) {
      freeboard = std::fmin(freeboard, wave->freeboard);
    }
    if (!std::isfinite(state.tilt_x) || !std::isfinite(state.tilt_y)) continue;
    liquid.begin_row(to_seconds(at));
    liquid.add_list(std::array{state.tilt_x, state.tilt_y}, 4);
    liquid.add(1e3 * freeboard, 1);
    liquid.add(state.spilled ? 1.0 : 0.0, 0);
    liquid.add(share, 3);
  }
  return liquid.json();
}

/// Members of one tool.
std::string tool_of(const SessionFile& session, int tool, double period, std::size_t most_rows) {
  const SessionFile::Liquid& liquid = session.liquids[tool];
  return fmt::format("{},\"target\":{{{}}},\"felt\":{{{}}},\"slosh\":{},\"off_target_mm\":{},\"liquid\":{{{}}}",
                     gripper_of(session, tool, most_rows), target_of(session, tool, period, most_rows),
                     felt_of(liquid, most_rows), slosh_of(session, tool), off_target_of(session, tool),
                     liquid_of(liquid, most_rows));
}

}  // namespace

std::string motion_json(const SessionFile& session, double period, std::size_t most_rows) {
  std::string others;
  for (int t = 1; t < session.names.tool_count(); ++t) {
    others += fmt::format("{}{{\"name\":{},{}}}", t > 1 ? "," : "", dump(session.names.tools[t]),
                          tool_of(session, t, period, most_rows));
  }
  if (!others.empty()) others = fmt::format("\"tool\":{},\"other_tools\":[{}],", dump(session.names.tools[0]), others);
  return fmt::format("{{\"name\":{},{},{},{}\"settings\":{},\"events\":{}}}", dump(session.name),
                     arm_of(session, most_rows), tool_of(session, 0, period, most_rows), others, settings_of(session),
                     events_of(session));
}

}  // namespace steadyhand
