#include "steadyhand/report/figures/session_story.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <utility>

namespace steadyhand {

namespace {

using Json = nlohmann::json;

constexpr double kGap = 0.5;             ///< s between two plans from which on it counts as a gap
constexpr double kRestless = 0.01;       ///< rad (m), by which a joint of a stationary arm may differ
constexpr double kLimitsApart = 1.0;     ///< s; a limit that repeats within this time is reported once
constexpr double kInstant = 1e-3;        ///< s
constexpr double kAllOf = 0.99;          ///< share of a time from which on it counts as all of it
constexpr double kMissedApart = 10.0;    ///< s
constexpr std::size_t kMostResults = 8;  ///< as many colours and columns as a reader can distinguish

/// Label of this profile in the report.
std::string label_of(const SessionFile& session, const std::string& profile) {
  const auto labels = session.overview.metadata.find("profiles");
  if (labels != session.overview.metadata.end()) {
    if (const auto label = labels->second.find(profile); label != labels->second.end()) return label->second;
  }
  return profile == session.run("profile") && !session.run("label").empty() ? session.run("label") : profile;
}

std::string profile_of(const SessionFile& session, const SettingsChange& change) {
  return change.profile.empty() ? session.run("profile") : change.profile;
}

/// At least three digits, without powers of ten.
std::string number(double value) {
  return value < 1000.0 ? fmt::format("{:.3g}", value) : fmt::format("{:.0f}", value);
}

/// "lateral 3, acceleration step 0.3": entries of `weights` that are not as in `usual`.
std::string other_weights(const SettingsChange& change, const SettingsChange& usual) {
  std::string text;
  for (const auto& [name, values] : change.weights) {
    const auto before = usual.weights.find(name);
    if (values.empty() || (before != usual.weights.end() && before->second == values)) continue;
    text += fmt::format(", {} {}", term_text(name), weight_text(values));
  }
  return text;
}

std::string tilt_text(double tilt) {
  return tilt > std::numbers::pi - 1e-3 ? "tilts with the hand" : fmt::format("tilt {}°", number(tilt * kDegrees));
}

/// True if the figures under both settings are comparable.
bool same_conditions(const SettingsChange& a, const SettingsChange& b) {
  return a.profile == b.profile && a.weights == b.weights && a.scale == b.scale && a.tilt == b.tilt &&
         a.no_spill == b.no_spill;
}

/// The settings in force at time t; before the first change, the first.
const SettingsChange* in_force(const std::vector<SettingsChange>& settings, Time t) {
  if (settings.empty()) return nullptr;
  const auto after = std::upper_bound(settings.begin(), settings.end(), t,
                                      [](Time at, const SettingsChange& change) { return at < change.at; });
  return after == settings.begin() ? &settings.front() : &*std::prev(after);
}

std::string describe(const SessionFile& session, const SettingsChange& change, const SettingsChange& usual) {
  std::string text = fmt::format("scale {}{}", number(change.scale), other_weights(change, usual));
  if (change.tilt && change.tilt != usual.tilt) text += ", " + tilt_text(*change.tilt);
  return label_of(session, profile_of(session, change)) + ", " + text;
}

void tell_settings(const SessionFile& session, SessionStory& story) {
  std::map<std::string, const SettingsChange*> usual;  // for each profile, its first settings
  const SettingsChange* before = nullptr;
  for (const SettingsChange& change : session.settings) {
    const SettingsChange* first = usual.try_emplace(change.profile, &change).first->second;
    const bool told = before && same_conditions(*before, change) && before->yaw == change.yaw;
    if (!told) story.events.push_back({to_seconds(change.at), "setting", describe(session, change, *first), ""});
    before = &change;
  }
}

/// Names of the arm's bodies from the session's metadata; empty in older sessions.
std::vector<std::string> body_names(const std::string& robot) {
  std::vector<std::string> names;
  const Json json = Json::parse(robot, nullptr, false);
  const auto bodies = json.find("bodies");
  if (!json.is_object() || bodies == json.end() || !bodies->is_array()) return names;
  for (const Json& body : *bodies) {
    const auto name = body.find("name");
    names.push_back(body.is_object() && name != body.end() && name->is_string() ? name->get<std::string>() : "");
  }
  return names;
}

/// The names behind the numbers of limits.
class Parts {
 public:
  explicit Parts(const SessionFile& session, const std::string& robot)
      : session_(session), bodies_(body_names(robot)) {}

  std::string joint(int i) const {
    const std::vector<std::string>& joints = session_.names.joints;
    return has(joints, i) ? part_text(joints[static_cast<std::size_t>(i)]) : "a joint";
  }
  /// After the arm's bodies come the objects that the tool carries.
  std::string solid(int i, Time at) const {
    constexpr int kCarried = 128;  // docs/reference/protocol.md
    if (i >= kCarried) return object(i - kCarried, at);
    const std::string name = has(bodies_, i) ? part_text(bodies_[static_cast<std::size_t>(i)]) : "";
    return name.empty() ? "the arm" : name;
  }
  std::string object(int i, Time at) const {
    const Cell* cell = nullptr;
    for (const CellChange& change : session_.cells) {
      if (change.at <= at || cell == nullptr) cell = &change.cell;
    }
    return cell != nullptr && has(cell->objects, i) ? cell->objects[static_cast<std::size_t>(i)].name : "an object";
  }

 private:
  template <typename List>
  static bool has(const List& list, int i) {
    return i >= 0 && static_cast<std::size_t>(i) < list.size();
  }
  const SessionFile& session_;
  std::vector<std::string> bodies_;
};

/// As the operator's page words it (web/src/session.ts).
std::string limit_text(const SessionFile::Limit& limit, const Parts& parts) {
  const auto& [at, kind, first, second] = limit;
  if (kind == "position") return parts.joint(first) + " is at its position limit";
  if (kind == "velocity") return parts.joint(first) + " is at its top speed";
  if (kind == "acceleration") return parts.joint(first) + " is at its top acceleration";
  if (kind == "self_collision") return parts.solid(first, at) + " is close to " + parts.solid(second, at);
  if (kind == "obstacle") return parts.solid(first, at) + " is close to " + parts.object(second, at);
  return kind == "reach" ? "the target is out of reach" : kind;
}

void tell_limits(const SessionFile& session, SessionStory& story) {
  const Parts parts(session, story.robot);
  double last = -2.0 * kLimitsApart;
  std::string held;
  for (const SessionFile::Limit& limit : session.limits) {
    if (limit.kind == "none") continue;
    const double t = to_seconds(limit.at);
    const std::string what = limit_text(limit, parts);
    if (what != held || t - last > kLimitsApart) story.events.push_back({t, "limit", what, ""});
    held = what;
    last = t;
  }
}

/// True if plans or commands were late in the second before: the arm held, or continued by an older plan.
bool was_late(const SessionFile& session, Time at) {
  constexpr Time kBefore = std::chrono::seconds(1);
  for (const SessionFile::Change& change : session.changes) {
    if (change.at > at - kBefore && change.at <= at && change.code == ReasonCode::kPlannerLate) return true;
  }
  const SessionStatistics *before = nullptr, *after = nullptr;
  for (const SessionStatistics& counted : session.statistics) {
    if (counted.now <= at - kBefore || !before) before = &counted;
    after = &counted;
    if (counted.now >= at) break;
  }
  return before &&
         (after->rejected_plans > before->rejected_plans || after->missed_deadlines > before->missed_deadlines);
}

/// The settings in force, the arm's state, and the lateral specific force at the time of a spill.
SessionStory::Spill explain_spill(const SessionFile& session, int tool, const SpillLog::Spill& seen) {
  SessionStory::Spill spill;
  spill.tool = tool;
  const Time at = seen.at;
  spill.t_s = to_seconds(at);
  spill.share = seen.share;
  spill.lateral = seen.lateral;
  spill.within_s = to_seconds(seen.lost - at);
  if (seen.full_again) spill.full_again_s = to_seconds(*seen.full_again);
  const SettingsChange* settings = in_force(session.settings, at);
  const std::string profile = label_of(session, settings ? profile_of(session, *settings) : session.run("profile"));
  std::string state;
  for (const SessionFile::Change& change : session.changes) {
    if (change.at <= at && change.tool == tool) state = change.to;
  }
  const auto spares = settings ? settings->no_spill : std::nullopt;
  if (spares == false) {
    spill.cause = profile + " does not keep the liquid in";
  } else if (state == "stopping") {
    spill.cause = "in a stop, under " + profile;
  } else if (state == "fault") {
    spill.cause = "in a stop by a fault, under " + profile;
  } else if (!spares) {
    spill.cause = "under " + profile;
  } else if (was_late(session, at)) {
    spill.cause = "the planner was late: " + profile + " cannot keep the liquid in on a computer that is too slow";
  } else {
    spill.cause = profile + " should have kept the liquid in" + (state == "engaged" ? "" : ", while not engaged");
  }
  if (spill.lateral > 0.0)
    spill.cause += fmt::format("; lateral specific force up to {:.2f} m/s² just before", spill.lateral);
  if (spill.lateral > 0.0 && seen.lateral_until > spill.lateral) {  // includes gravity once the glass leans
    spill.cause += fmt::format(", {:.2f} while it ran out", seen.lateral_until);
  }
  return spill;
}

/// JSON, as `steadyhand describe` prints it; empty: not recorded.
std::string robot_of(const SessionFile& session) {
  const auto robot = session.overview.metadata.find("robot");
  if (robot == session.overview.metadata.end()) return {};
  const auto json = robot->second.find("json");
  return json == robot->second.end() ? std::string() : json->second;
}

/// A gripper has no glass, though its sessions record a liquid at rest.
bool has_gripper(const std::string& robot, int tool) {
  const Json json = Json::parse(robot, nullptr, false);
  if (!json.is_object()) return false;
  const auto tools = json.find("tools");
  if (tools == json.end() || !tools->is_array()) return json.contains("gripper");  // of older versions
  const auto index = static_cast<std::size_t>(tool);
  return index < tools->size() && (*tools)[index].is_object() && (*tools)[index].contains("gripper");
}

/// Whether the tool holds a glass whose liquid was recorded.
bool knows_liquid(const SessionFile& session, int tool) {
  return !session.liquids[tool].states.empty() && !has_gripper(robot_of(session), tool);
}

std::vector<SessionStory::Spill> spills_of(const SessionFile& session) {
  std::vector<SessionStory::Spill> spills;
  for (int t = 0; t < session.names.tool_count(); ++t) {
    if (!knows_liquid(session, t)) continue;
    for (const SpillLog::Spill& seen : session.liquids[t].spills.spills()) {
      spills.push_back(explain_spill(session, t, seen));
    }
  }
  std::ranges::stable_sort(spills, {}, &SessionStory::Spill::t_s);
  return spills;
}

/// "left: ", of a robot with several tools.
std::string of_tool(const SessionFile& session, int tool) {
  return session.names.tool_count() > 1 ? session.names.tools[tool] + ": " : "";
}

void tell_spills(const SessionFile& session, SessionStory& story) {
  story.has_glass = false;
  for (int t = 0; t < session.names.tool_count(); ++t) {
    story.has_glass = story.has_glass || !has_gripper(story.robot, t);
    story.knows_liquid = story.knows_liquid || knows_liquid(session, t);
  }
  story.spills = spills_of(session);
  for (const SessionStory::Spill& spill : story.spills) {
    const std::string of = of_tool(session, spill.tool);
    story.events.push_back({spill.t_s, "spill", of + spill_text(spill), spill.cause, spill.share});
    if (spill.full_again_s) story.events.push_back({*spill.full_again_s, "refill", of + "a full glass", ""});
  }
}

/// A change of all tools at once is one event of the robot.
void tell_states(const SessionFile& session, SessionStory& story) {
  const std::vector<SessionFile::Change>& changes = session.changes;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const SessionFile::Change& change = changes[i];
    const auto same = [&](const SessionFile::Change& other) {
      return other.tool != change.tool && other.at == change.at && other.to == change.to &&
             other.reason == change.reason;
    };
    const bool of_all = i + 1 < changes.size() && same(changes[i + 1]);
    const std::string of = of_all ? "" : of_tool(session, change.tool);
    story.events.push_back({to_seconds(change.at), "state", change.to, of + change.reason});
    i += of_all;
  }
}

constexpr int kAnyTool = -1;

/// From when to when the tool was engaged.
std::vector<std::pair<Time, Time>> stretches_led(const SessionFile& session, int tool = kAnyTool) {
  std::vector<std::pair<Time, Time>> stretches;
  PerTool<bool> engaged{};
  Time since{0};
  bool led = false;
  const auto see = [&](Time at, bool now) {
    if (led && at > since) stretches.emplace_back(since, at);
    since = at;
    led = now;
  };
  for (const SessionFile::Change& change : session.changes) {
    engaged[change.tool] = change.to == "engaged";
    see(change.at, tool == kAnyTool ? std::ranges::find(engaged, true) != engaged.end() : engaged[tool]);
  }
  see(session.overview.last, false);
  return stretches;
}

/// Time between these times in which the tool was engaged, s.
double led_between(const SessionFile& session, double from, double until, int tool = kAnyTool) {
  double led = 0.0;
  for (const auto& [begin, end] : stretches_led(session, tool)) {
    led += std::max(0.0, std::min(to_seconds(end), until) - std::max(to_seconds(begin), from));
  }
  return led;
}

/// Time from which on the arm was stationary until `until`, s; `from` if no motion was recorded.
double rest_begins(const SessionFile& session, double from, double until) {
  double begin = from;
  const JointState* last = nullptr;
  for (auto state = session.states.rbegin(); state != session.states.rend(); ++state) {
    const double t = to_seconds(state->stamp.made);
    if (t >= until || !state->q.allFinite()) continue;
    if (t < from) break;
    if (last == nullptr) last = &*state;
    if ((state->q - last->q).cwiseAbs().maxCoeff() > kRestless) return begin;
    begin = t;
  }
  return from;
}

/// Adds a gap for each damaged part of the file.
void tell_losses(const SessionFile& session, SessionStory& story) {
  for (const McapLoss& loss : session.overview.lost) {
    const double seconds = to_seconds(loss.last - loss.first);
    story.events.push_back({to_seconds(loss.first), "gap", fmt::format("{:.1f} s are lost", seconds),
                            fmt::format("the file is damaged at byte {}: {}", loss.at, loss.reason)});
  }
}

bool is_lost(const SessionFile& session, double from, double until) {
  return std::any_of(session.overview.lost.begin(), session.overview.lost.end(), [&](const McapLoss& loss) {
    return to_seconds(loss.first) < until && from < to_seconds(loss.last);
  });
}

/// Adds gaps between plans: a stationary arm needs no plan, a moving one follows its last plan or a stop.
void tell_gaps(const SessionFile& session, SessionStory& story) {
  for (std::size_t i = 1; i < session.steps.size(); ++i) {
    const double from = session.steps[i - 1].t_s, until = session.steps[i].t_s;
    if (until - from <= kGap || is_lost(session, from, until)) continue;
    if (const double led = led_between(session, from, until); led > kGap) {
      story.events.push_back({from, "gap", fmt::format("no plan for {:.1f} s while engaged", led), ""});
      continue;
    }
    const double rest = rest_begins(session, from, until);
    if (until - rest > kGap)
      story.events.push_back({rest, "rest", fmt::format("stationary for {:.1f} s", until - rest), ""});
  }
}

std::string missed_text(double count, double within) {
  const std::string text = fmt::format("{:.0f} missed deadline{} of control", count, count == 1.0 ? "" : "s");
  return within > 0.0 ? fmt::format("{} within {:.0f} s", text, std::ceil(within)) : text;
}

void tell_counts(const SessionFile& session, SessionStory& story) {
  std::uint64_t missed = 0;
  // Misses in quick succession are one event, otherwise they would hide all others.
  std::vector<SessionStory::Event> misses;
  double last = 0.0;
  const bool stalls = std::any_of(session.changes.begin(), session.changes.end(),
                                  [](const auto& change) { return change.code == ReasonCode::kStalled; });
  const std::string why = stalls ? "" : "too short to stop the arm, which followed its plan";
  for (const SessionStatistics& counted : session.statistics) {
    const double t = to_seconds(counted.now);
    // All zeros: no command was made from a hand yet.
    if (counted.latency_us.p99 > 0.0) {
      story.latency.push_back({t, 1e-3 * counted.latency_us.p50, 1e-3 * counted.latency_us.p99});
    }
    if (counted.missed_deadlines > missed) {
      if (misses.empty() || t - last > kMissedApart) misses.push_back({t, "missed", "", why});
      SessionStory::Event& event = misses.back();
      event.amount += static_cast<double>(counted.missed_deadlines - missed);
      event.what = missed_text(event.amount, t - event.t_s);
      last = t;
    }
    missed = counted.missed_deadlines;
  }
  std::move(misses.begin(), misses.end(), std::back_inserter(story.events));
}

/// Dragging a slider passes through dozens of settings: those with the most steps stay, the others are merged.
void merge_the_briefest(std::vector<ProfileResult>& results) {
  if (results.size() <= kMostResults) return;
  std::vector<std::size_t> lengths;
  for (const ProfileResult& result : results) lengths.push_back(result.steps.size());
  std::nth_element(lengths.begin(), lengths.begin() + kMostResults - 2, lengths.end(), std::greater<>());
  const std::size_t least = lengths[kMostResults - 2];
  std::vector<ProfileResult> kept;
  ProfileResult brief;
  int count = 0;
  for (ProfileResult& result : results) {
    if (result.steps.size() >= least && kept.size() < kMostResults - 1) {
      kept.push_back(std::move(result));
      continue;
    }
    if (count++ == 0) {
      brief = std::move(result);
      continue;
    }
    std::move(result.steps.begin(), result.steps.end(), std::back_inserter(brief.steps));
    std::move(result.commands.begin(), result.commands.end(), std::back_inserter(brief.commands));
    brief.led_s += result.led_s;
    for (std::size_t t = 0; t < result.liquids.size(); ++t) {
      ProfileResult::Liquid &into = brief.liquids[t], &from = result.liquids[t];
      std::move(from.felt.begin(), from.felt.end(), std::back_inserter(into.felt));
      into.spills += std::max(from.spills, 0);  // known for all results or for none
      into.spilled_share = std::max(into.spilled_share, from.spilled_share);
    }
  }
  const auto by_time = [](const auto& time) {
    return [time](const auto& a, const auto& b) { return time(a) < time(b); };
  };
  std::stable_sort(brief.steps.begin(), brief.steps.end(), by_time([](const PlanStep& step) { return step.t_s; }));
  std::stable_sort(brief.commands.begin(), brief.commands.end(),
                   by_time([](const JointCommand& command) { return command.stamp.made; }));
  brief.name = "other";
  brief.label = fmt::format("{} other settings, in passing", count);
  kept.push_back(std::move(brief));
  results = std::move(kept);
}

}  // namespace

std::string percent_text(double share) {
  const std::string text = fmt::format("{:.1f}", 100.0 * share);
  return text == "100.0" ? "100" : text == "0.0" && share > 0.0 ? "less than 0.1" : text;
}

std::string spill_text(const SessionStory::Spill& spill) {
  constexpr double kAtOnce = 0.1;  // s
  const std::string within = spill.within_s < kAtOnce ? "" : fmt::format(" within {:.1f} s", spill.within_s);
  return fmt::format("spilled {} % of the liquid{}", percent_text(spill.share), within);
}

std::string part_text(const std::string& name) {
  // Suffixes with the kind of part; trailing numbers, except where the number is the name.
  static const std::regex kKind("_(joint|link|body|bottom|top)$"), kNumber("_\\d+$");
  static const std::regex kCounted("(^|.*_)(wrist|joint|axis|finger)");
  std::string part = std::regex_replace(name, kKind, "");
  const std::string rest = std::regex_replace(part, kNumber, "");
  if (!rest.empty() && !std::regex_match(rest, kCounted)) part = rest;
  part = std::regex_replace(part, kKind, "");
  std::replace(part.begin(), part.end(), '_', ' ');
  return part;
}

std::vector<std::string> part_texts(const std::vector<std::string>& names) {
  std::vector<std::string> texts;
  for (const std::string& name : names) texts.push_back(part_text(name));
  std::vector<std::string> told = texts;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::count(texts.begin(), texts.end(), texts[i]) > 1) told[i] = names[i];
  }
  return told;
}

std::string term_text(const std::string& name) {
  std::string text = name;
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string weight_text(const std::vector<double>& values) {
  const bool is_one = std::equal(values.begin() + 1, values.end(), values.begin());
  std::string text;
  for (const double value : is_one ? std::vector(1, values.front()) : values) text += " " + number(value);
  return text.substr(1);
}

SessionStory tell_story(const SessionFile& session) {
  SessionStory story;
  story.begin_s = to_seconds(session.overview.first);
  story.end_s = to_seconds(session.overview.last);
  story.robot = robot_of(session);
  tell_states(session, story);
  tell_settings(session, story);
  tell_spills(session, story);
  tell_limits(session, story);
  tell_counts(session, story);
  tell_gaps(session, story);
  tell_losses(session, story);
  story.led_s = led_between(session, story.begin_s, story.end_s);
  std::stable_sort(story.events.begin(), story.events.end(),
                   [](const auto& a, const auto& b) { return a.t_s < b.t_s; });
  return story;
}

std::vector<SessionFile::Felt> felt_while_led(const SessionFile& session, int tool) {
  const std::vector<SessionFile::Felt>& felt = session.liquids[tool].felt;
  std::vector<SessionFile::Felt> led;
  for (std::size_t i = 0; i < felt.size(); ++i) {
    // Engaged up to the next entry: otherwise the first moment of a stop would count.
    const double t = to_seconds(felt[i].at), end = i + 1 < felt.size() ? to_seconds(felt[i + 1].at) : t + kInstant;
    if (led_between(session, t, end, tool) > kAllOf * (end - t)) led.push_back(felt[i]);
  }
  return led;
}

std::vector<ProfileResult> split_by_settings(SessionFile session) {
  std::vector<ProfileResult> results;
  std::vector<const SettingsChange*> conditions;       // for each result; null: not known
  std::map<std::string, const SettingsChange*> usual;  // for each profile, its first settings
  const std::vector<SettingsChange>& settings = session.settings;
  const auto result_at = [&](Time t, bool begin) -> ProfileResult* {
    const SettingsChange* now = in_force(settings, t);
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (conditions[i] == now || (now && conditions[i] && same_conditions(*conditions[i], *now))) return &results[i];
    }
    if (!begin) return nullptr;
    conditions.push_back(now);
    ProfileResult& added = results.emplace_back();
    added.name = now ? profile_of(session, *now) : session.run("profile");
    added.label = now ? describe(session, *now, *usual.try_emplace(now->profile, now).first->second)
                      : label_of(session, added.name) + ", as driven";
    added.weights = now && !now->weights.empty() ? now->weights : read_weights(session.run("weights"));
    added.names = session.names;
    added.limits = {session.velocity_max, session.acceleration_max};
    added.commands_merged = session.commands_merged;
    return &added;
  };
  for (PlanStep& step : session.steps) result_at(from_seconds(step.t_s), true)->steps.push_back(std::move(step));
  for (int t = 0; t < session.names.tool_count(); ++t) {
    for (const SessionFile::Felt& felt : felt_while_led(session, t)) {
      if (ProfileResult* result = result_at(felt.at, false))
        result->liquids[t].felt.push_back({felt.sum, felt.largest, felt.count});
    }
  }
  for (auto [from, end] : stretches_led(session)) {
    // A change of settings while engaged begins another stretch.
    for (const SettingsChange& change : settings) {
      if (change.at <= from || change.at >= end) continue;
      if (ProfileResult* result = result_at(from, false)) result->led_s += to_seconds(change.at - from);
      from = change.at;
    }
    if (ProfileResult* result = result_at(from, false)) result->led_s += to_seconds(end - from);
  }
  for (JointCommand& command : session.commands) {
    if (ProfileResult* result = result_at(command.stamp.made, false)) result->commands.push_back(std::move(command));
  }
  for (int t = 0; t < session.names.tool_count(); ++t) {
    for (ProfileResult& result : results) result.liquids[t].spills = knows_liquid(session, t) ? 0 : -1;
  }
  for (const SessionStory::Spill& spill : spills_of(session)) {
    ProfileResult* result = result_at(from_seconds(spill.t_s), false);
    if (result == nullptr) continue;  // no plan was made under these settings
    ProfileResult::Liquid& liquid = result->liquids[spill.tool];
    ++liquid.spills;
    liquid.spilled_share = std::max(liquid.spilled_share, spill.share);
  }
  merge_the_briefest(results);
  return results;
}

}  // namespace steadyhand
