#include "steadyhand/files/record/session_file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>

#include "steadyhand/core/folder.hpp"
#include "steadyhand/files/record/cell_json.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

/// null stands for what is not finite.
double read_number(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

Time read_time(const Json& json) {
  const Json &sec = json.at("sec"), &nsec = json.at("nsec");
  const bool whole = sec.is_number_integer() && nsec.is_number_integer();
  constexpr std::int64_t kMost = 9'000'000'000, kSecond = 1'000'000'000;
  if (!whole || std::abs(sec.get<double>()) > kMost || std::abs(nsec.get<double>()) >= kSecond) {
    throw std::runtime_error("a timestamp is expected");
  }
  return std::chrono::seconds(sec.get<std::int64_t>()) + Time(nsec.get<std::int64_t>());
}

Vector3 read_vector3(const Json& json) {
  return {read_number(json.at("x")), read_number(json.at("y")), read_number(json.at("z"))};
}

Pose read_pose(const Json& json) {
  const Json& q = json.at("orientation");
  return {read_vector3(json.at("position")),
          Quaternion(read_number(q.at("w")), read_number(q.at("x")), read_number(q.at("y")), read_number(q.at("z")))};
}

JointVector read_joints(const Json& json) {
  if (!json.is_array() || json.size() > kMaxJoints) throw std::runtime_error("a list of joints is expected");
  JointVector values(static_cast<Eigen::Index>(json.size()));
  for (std::size_t i = 0; i < json.size(); ++i) values[static_cast<Eigen::Index>(i)] = read_number(json[i]);
  return values;
}

/// None, where nothing is said of one.
std::optional<double> read_gripper(const Json& json) {
  const auto gripper = json.find("gripper");
  return gripper == json.end() ? std::nullopt : std::optional(read_number(*gripper));
}

OperatorSample operator_sample(const Json& json, const McapMessage& message) {
  OperatorSample sample;
  sample.stamp = {read_time(json.at("timestamp")), message.log};
  sample.X_operator_hand = read_pose(json.at("pose"));
  sample.clutch = json.at("clutch").get<bool>();
  sample.tracked = json.at("tracked").get<bool>();
  sample.emulated = json.at("emulated").get<bool>();
  if (const auto lead = json.find("lead_s"); lead != json.end()) sample.look_ahead = from_seconds(read_number(*lead));
  sample.gripper = read_gripper(json);
  if (const auto leader = json.find("leader"); leader != json.end()) {
    for (const Leader each : {Leader::kPerson, Leader::kRecording, Leader::kPolicy}) {
      if (leader->get_ref<const std::string&>() == to_string(each)) sample.leader = each;
    }
  }
  if (const auto flag = json.find("intervention"); flag != json.end()) sample.intervention = flag->get<bool>();
  return sample;
}

PlanOrigin origin(const std::string& name) {
  for (const PlanOrigin each : {PlanOrigin::kSolved, PlanOrigin::kFeasible, PlanOrigin::kPrevious}) {
    if (to_string(each) == name) return each;
  }
  throw std::runtime_error("unknown status '" + name + "'");
}

/// The terms that a step tells of, in their order.
std::vector<std::string> terms_of(std::string_view step) {
  std::vector<std::string> terms;
  const auto json = nlohmann::ordered_json::parse(step);
  for (const auto& [name, share] : json.at("shares").items()) terms.push_back(name);
  if (terms.size() > kMaxObjectives) {
    throw std::runtime_error(fmt::format("{} terms; there are at most {}", terms.size(), kMaxObjectives));
  }
  return terms;
}

PlanStep plan_step(const Json& json, const std::vector<std::string>& terms) {
  PlanStep step;
  step.t_s = to_seconds(read_time(json.at("timestamp")));
  step.X_base_target = read_pose(json.at("target"));
  step.X_base_planned = read_pose(json.at("planned"));
  step.q = read_joints(json.at("q"));
  step.dq = read_joints(json.at("dq"));
  step.ddq = read_joints(json.at("ddq"));
  step.local_acceleration = read_vector3(json.at("local_acceleration"));
  step.objective = read_number(json.at("objective"));
  const Json& shares = json.at("shares");
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (shares.contains(terms[i])) step.shares[i] = read_number(shares[terms[i]]);
  }
  step.iterations = json.at("iterations").get<int>();
  step.status = origin(json.at("status").get<std::string>());
  step.solve_time_us = read_number(json.at("solve_time_us"));
  step.smallest_sphere_distance_m = read_number(json.at("smallest_sphere_distance_m"));
  step.engaged = json.at("engaged").get<bool>();
  if (const auto distances = json.find("object_distances_m"); distances != json.end()) {
    for (const auto& [name, distance] : distances->items())
      step.object_distances.emplace_back(name, read_number(distance));
  }
  return step;
}

EpisodeMark episode_mark(const Json& json, const McapMessage& message) {
  EpisodeMark mark;
  mark.at = message.log;
  mark.episode = json.at("episode").get<int>();
  const std::string kind = json.at("kind").get<std::string>();
  const auto known = find_name<EpisodeMark::Kind>(kind);
  if (!known) throw std::runtime_error("kind is '" + kind + "'; it must be begin, keep, discard or mark");
  mark.kind = *known;
  if (json.contains("success")) mark.success = json.at("success").get<bool>();
  mark.task = json.value("task", "");
  mark.notes = json.value("notes", "");
  return mark;
}

SceneLook scene_look(const Json& json, const McapMessage& message) {
  SceneLook look;
  look.scene.at = message.log;
  look.scene.reset = json.at("reset").get<std::uint64_t>();
  const Json& things = json.at("things");
  if (things.size() > kMaxThings) {
    throw std::runtime_error(fmt::format("{} things; {} are the most", things.size(), kMaxThings));
  }
  const auto vector = [](const Json& read) {
    return Vector3(read_number(read.at(0)), read_number(read.at(1)), read_number(read.at(2)));
  };
  for (const Json& thing : things) {
    ThingState& state = look.scene.thing[look.scene.things++];
    state.X_base_thing = read_pose(thing.at("pose"));
    state.velocity = vector(thing.at("velocity"));
    state.turning = vector(thing.at("turning"));
    state.touches = thing.at("touches").get<std::uint32_t>();
  }
  look.progress.time = read_number(json.at("time_s"));
  look.progress.held = json.at("held").get<std::uint32_t>();
  look.progress.spilled = read_number(json.at("spilled_share"));
  if (json.contains("success")) look.progress.success = json.at("success").get<bool>();
  return look;
}

SettingsChange settings_change(const Json& json, const McapMessage& message) {
  SettingsChange change;
  change.at = message.log;
  for (const auto& [name, values] : json.at("weights").items()) {
    for (const Json& value : values) change.weights[name].push_back(read_number(value));
  }
  change.scale = read_number(json.at("scale"));
  change.yaw = read_number(json.at("yaw"));
  if (json.contains("tilt")) change.tilt = read_number(json.at("tilt"));
  if (json.contains("no_spill")) change.no_spill = json.at("no_spill").get<bool>();
  if (json.contains("latency")) change.latency = json.at("latency").get<double>();
  if (json.contains("fill")) change.fill = read_number(json.at("fill"));
  if (json.contains("prediction")) change.prediction = json.at("prediction").get<std::string>();
  if (json.contains("profile")) change.profile = json.at("profile").get<std::string>();
  if (!(change.scale > 0.0) || !std::isfinite(change.scale) || !std::isfinite(change.yaw)) {
    throw std::runtime_error(
        fmt::format("scale is {} and yaw {}; both must be finite, the scale above 0", change.scale, change.yaw));
  }
  return change;
}

LiquidState liquid_state(const Json& json) {
  LiquidState liquid{read_number(json.at("tilt_x")), read_number(json.at("tilt_y")), read_number(json.at("freeboard")),
                     json.at("spilled").get<bool>()};
  if (json.contains("spilled_share")) liquid.spilled_share = read_number(json.at("spilled_share"));
  liquid.lateral =
      json.contains("lateral") ? read_number(json.at("lateral")) : std::numeric_limits<double>::quiet_NaN();
  return liquid;
}

/// What was felt between two looks stays, as a sum and the largest.
void add_felt(Time at, double lateral, double period, std::vector<SessionFile::Felt>& felt) {
  if (!std::isfinite(lateral)) return;
  if (felt.empty() || to_seconds(at - felt.back().at) >= period - 1e-9) felt.push_back({at});
  SessionFile::Felt& now = felt.back();
  now.sum += lateral;
  now.largest = std::max(now.largest, lateral);
  ++now.count;
}

/// No crest between two looks is missed.
void add_wave(Time at, const LiquidState& liquid, double period, std::vector<SessionFile::Wave>& waves) {
  if (!std::isfinite(liquid.freeboard)) return;
  if (waves.empty() || to_seconds(at - waves.back().at) >= period - 1e-9) waves.push_back({at, liquid.freeboard, 0.0});
  SessionFile::Wave& now = waves.back();
  now.freeboard = std::min(now.freeboard, liquid.freeboard);
  if (liquid.spilled) now.spilled_share = std::max(now.spilled_share, liquid.spilled_share);
}

TimingSummary timing(const Json& json) {
  return {read_number(json.at("p50")), read_number(json.at("p99")), read_number(json.at("p999")),
          read_number(json.at("max"))};
}

SessionStatistics statistics(const Json& json, const McapMessage& message) {
  SessionStatistics counted;
  counted.now = message.log;
  counted.latency_us = timing(json.at("latency"));
  counted.solve_us = timing(json.at("solve"));
  counted.wake_us = timing(json.at("wake"));
  counted.samples = json.at("samples").get<std::uint64_t>();
  counted.plans = json.at("plans").get<std::uint64_t>();
  counted.rejected_plans = json.at("rejected_plans").get<std::uint64_t>();
  counted.cycles = json.at("cycles").get<std::uint64_t>();
  counted.missed_deadlines = json.at("missed_deadlines").get<std::uint64_t>();
  counted.planner_rate_hz = read_number(json.at("planner_rate_hz"));
  return counted;
}

Cell read_cell(const McapMessage& message) {
  try {
    return read_cell_json(OrderedJson::parse(message.data).at("cell"), "cell");
  } catch (const json::Wrong& wrong) {
    throw std::runtime_error(wrong.message);
  }
}

/// Takes the commands of a session one after another, at most so many.
class CommandList {
 public:
  CommandList(SessionFile& session, std::size_t most) : session_(&session), most_(most) {}
  void add(const JointCommand& command) {
    std::vector<JointCommand>& commands = session_->commands;
    if (in_last_ < session_->commands_merged && fits(commands.back(), command)) {
      merge(commands.back(), command);
      ++in_last_;
      return;
    }
    commands.push_back(command);
    in_last_ = 1;
    if (commands.size() > most_) halve();
  }

 private:
  static bool fits(const JointCommand& a, const JointCommand& b) {
    return a.dq.size() == b.dq.size() && a.ddq.size() == b.ddq.size();
  }
  static void merge(JointCommand& into, const JointCommand& next) {
    into.dq = into.dq.cwiseAbs().cwiseMax(next.dq.cwiseAbs());
    into.ddq = into.ddq.cwiseAbs().cwiseMax(next.ddq.cwiseAbs());
  }
  void halve() {
    std::vector<JointCommand>& commands = session_->commands;
    const std::size_t count = commands.size();
    for (std::size_t i = 0; i < count; i += 2) {
      commands[i / 2] = commands[i];
      if (i + 1 < count && fits(commands[i], commands[i + 1])) merge(commands[i / 2], commands[i + 1]);
    }
    in_last_ += count % 2 == 0 ? session_->commands_merged : 0;
    session_->commands_merged *= 2;
    commands.resize((count + 1) / 2);
  }

  SessionFile* session_;
  std::size_t most_;
  int in_last_ = 1;  ///< commands that the last stands for
};

/// Everything that exceptions of the JSON library may leave.
void read_message(const McapMessage& message, const SessionParts& parts, SessionFile& session, CommandList& commands) {
  const auto is = [&](bool wanted, std::string_view topic) { return wanted && message.topic == topic; };
  const auto parsed = [&] { return Json::parse(message.data); };
  if (is(parts.samples, "/operator_sample")) {
    session.samples.push_back(operator_sample(parsed(), message));
  } else if (is(parts.steps, "/plan_step")) {
    if (session.steps.empty()) session.names.terms = terms_of(message.data);
    session.steps.push_back(plan_step(parsed(), session.names.terms));
  } else if (is(parts.commands, "/joint_command")) {
    const Json json = parsed();
    commands.add({{message.publish, message.log},
                  read_joints(json.at("q")),
                  read_joints(json.at("dq")),
                  read_joints(json.at("ddq")),
                  read_gripper(json)});
  } else if (is(parts.states, "/joint_state")) {
    if (!session.states.empty() &&
        to_seconds(message.log - session.states.back().stamp.made) < parts.state_period - 1e-9) {
      return;
    }
    const Json json = parsed();
    session.states.push_back(
        {{message.publish, message.log}, read_joints(json.at("q")), read_joints(json.at("dq")), read_gripper(json)});
  } else if (is(parts.changes, "/supervision")) {
    const Json json = parsed();
    session.changes.push_back({message.log, json.at("from"), json.at("to"), json.at("reason")});
  } else if (is(parts.settings, "/operator_settings")) {
    session.settings.push_back(settings_change(parsed(), message));
  } else if (is(parts.liquid, "/liquid")) {
    LiquidState liquid = liquid_state(parsed());
    add_felt(message.log, liquid.lateral, parts.felt_period, session.felt);
    add_wave(message.log, liquid, parts.felt_period, session.waves);
    session.spills.see(message.log, liquid, session.settings.empty() ? "" : session.settings.back().profile);
    const bool soon =
        !session.liquid.empty() && to_seconds(message.log - session.liquid.back().first) < parts.state_period - 1e-9;
    if (!soon || liquid.spilled != session.liquid.back().second.spilled)
      session.liquid.emplace_back(message.log, liquid);
  } else if (is(parts.limits, "/active_constraint")) {
    const Json json = parsed();
    session.limits.push_back({message.log, json.at("kind"), json.at("first"), json.at("second")});
  } else if (is(parts.statistics, "/statistics")) {
    session.statistics.push_back(statistics(parsed(), message));
  } else if (is(parts.episodes, "/episode")) {
    session.episodes.push_back(episode_mark(parsed(), message));
  } else if (is(parts.episodes, "/scene")) {
    session.scenes.push_back(scene_look(parsed(), message));
  } else if (is(parts.cells, "/cell")) {
    session.cells.push_back({message.log, read_cell(message)});
  }
}

/// What the metadata `robot` says.
void read_robot(const Json& robot, SessionFile& session) {
  for (const Json& joint : robot.at("joints")) {
    session.names.joints.push_back(joint.at("name"));
    session.names.joint_units.push_back(joint.at("type") == "prismatic" ? "m" : "rad");
  }
  session.velocity_max = read_joints(robot.at("velocity_max"));
  session.acceleration_max = read_joints(robot.at("acceleration_max"));
}

}  // namespace

std::string SessionFile::run(const std::string& key) const {
  const auto table = overview.metadata.find("run");
  if (table == overview.metadata.end()) return {};
  const auto entry = table->second.find(key);
  return entry == table->second.end() ? std::string() : entry->second;
}

Result<SessionFile> load_session(const fs::path& path, const SessionParts& parts) {
  SessionFile session;
  session.name = path.stem().string();
  CommandList commands(session, parts.most_commands);
  Result<McapOverview> overview = read_mcap(path, [&](const McapMessage& message) -> Status {
    try {
      read_message(message, parts, session, commands);
      return Done{};
    } catch (const std::exception& error) {
      return Error{fmt::format("{}: a message on {} at {:.3f} s does not fit: {}", path.string(), message.topic,
                               to_seconds(message.log), error.what())};
    }
  });
  if (!overview) return overview.error();
  session.overview = *std::move(overview);
  const auto robot = session.overview.metadata.find("robot");
  if (robot == session.overview.metadata.end()) {
    return Error{fmt::format("{}: does not tell its robot; it is no session of steadyhand's", path.string())};
  }
  try {
    read_robot(Json::parse(robot->second.at("json")), session);
  } catch (const std::exception& error) {
    return Error{fmt::format("{}: its robot cannot be read: {}", path.string(), error.what())};
  }
  const auto n = static_cast<Eigen::Index>(session.names.joints.size());
  const auto fits = [n](const auto& entry) { return entry.q.size() == n && entry.dq.size() == n; };
  if (session.velocity_max.size() != n || session.acceleration_max.size() != n ||
      !std::all_of(session.steps.begin(), session.steps.end(), fits) ||
      !std::all_of(session.commands.begin(), session.commands.end(), fits) ||
      !std::all_of(session.commands.begin(), session.commands.end(),
                   [n](const auto& c) { return c.ddq.size() == n; }) ||
      !std::all_of(session.states.begin(), session.states.end(), fits)) {
    return Error{fmt::format("{}: its robot has {} joints, and its messages others", path.string(), n)};
  }
  return session;
}

namespace {

/// When it began, as DATE_TIME in UTC. A program may make several files, which all have its begin in their names, so
/// what a file says itself comes first; one that says nothing, and that somebody gave another name, began no later than
/// it was written.
std::string begin_of(const SessionEntry& entry) {
  static const std::regex kDate(R"(^\d{4}-\d\d-\d\d_\d\d-\d\d-\d\d)");
  const auto told = [&](const char* key) {
    const auto found = entry.run.find(key);
    return found == entry.run.end() ? std::string() : found->second;
  };
  std::smatch date;
  for (const std::string& text : {told("recorded"), entry.name, told("started")}) {
    if (std::regex_search(text, date, kDate)) return date.str();
  }
  struct stat file {};
  if (stat(entry.path.c_str(), &file) != 0) return {};
  std::tm utc{};
  gmtime_r(&file.st_mtime, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof(text), "%Y-%m-%d_%H-%M-%S", &utc)};
}

}  // namespace

std::vector<SessionEntry> list_sessions(const fs::path& folder) {
  std::vector<SessionEntry> entries;
  std::error_code failed;
  for (const fs::directory_entry& file : entries_of(folder)) {
    if (file.path().extension() != ".mcap") continue;
    Result<McapOverview> overview = read_mcap(file.path());
    if (!overview) continue;
    SessionEntry entry;
    entry.path = file.path();
    entry.name = file.path().stem().string();
    entry.complete = overview->complete;
    entry.duration = to_seconds(overview->last - overview->first);
    entry.bytes = file.file_size(failed);
    entry.run = std::move(overview->metadata["run"]);
    entry.summary = std::move(overview->metadata["summary"]);
    entry.fault = std::move(overview->metadata["fault"]["reason"]);
    entries.push_back(std::move(entry));
  }
  std::sort(entries.begin(), entries.end(), [&](const SessionEntry& a, const SessionEntry& b) {
    return std::pair(begin_of(a), a.name) > std::pair(begin_of(b), b.name);
  });
  return entries;
}

}  // namespace steadyhand
