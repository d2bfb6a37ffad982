#include "steadyhand/files/record/session_file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <regex>
#include <stdexcept>

#include "steadyhand/core/folder.hpp"
#include "steadyhand/core/json_in.hpp"
#include "steadyhand/files/record/model_json.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

namespace {

/// Reads the message. Throws its error.
template <typename M>
void read(std::string_view text, M&& into) {
  const OrderedJson json = OrderedJson::parse(text);
  JsonIn<OrderedJson, MessageStyle> in(json, false);
  in.members(into);
  if (in.error()) throw std::runtime_error(in.error()->message);
}

/// Of recordings from before changes had a code; nothing asks for other codes of these.
std::optional<ReasonCode> code_of_words(std::string_view reason) {
  if (reason == "the planner is late") return ReasonCode::kPlannerLate;
  return reason.find("stalled") == std::string_view::npos ? std::nullopt : std::optional(ReasonCode::kStalled);
}

/// The names of the terms are those of the first step.
PlanStep read_step(const McapMessage& message, bool is_first, RunNames& names) {
  StepMessage told;
  read(message.data, told);
  if (told.shares.size() > kMaxObjectives && is_first) {
    throw std::runtime_error(fmt::format("{} terms; there are at most {}", told.shares.size(), kMaxObjectives));
  }
  for (const auto& [name, share] : told.shares) {
    if (is_first) names.terms.push_back(name);
    const auto term = std::find(names.terms.begin(), names.terms.end(), name);
    if (term != names.terms.end()) told.step.shares[static_cast<std::size_t>(term - names.terms.begin())] = share;
  }
  return told.step;
}

/// Values between two samples are kept as their sum and the largest.
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
  int in_last_ = 1;  ///< commands merged into the last one
};

/// Everything that exceptions of the JSON library may leave.
void read_message(const McapMessage& message, const SessionParts& parts, SessionFile& session, CommandList& commands) {
  const auto is = [&](bool wanted, std::string_view topic) { return wanted && message.topic == topic; };
  const auto soon = [&](Time last) { return to_seconds(message.log - last) < parts.state_period - 1e-9; };
  const Stamp stamp{message.publish, message.log};
  if (is(parts.samples, "/operator_sample")) {
    OperatorSample& sample = session.samples.emplace_back();
    read(message.data, Message{&sample});
    sample.stamp.made = message.log;
  } else if (is(parts.steps, "/plan_step")) {
    session.steps.push_back(read_step(message, session.steps.empty(), session.names));
  } else if (is(parts.commands, "/joint_command")) {
    JointCommand command;
    read(message.data, Message{&command});
    command.stamp = stamp;
    commands.add(command);
  } else if (is(parts.states, "/joint_state")) {
    if (!session.states.empty() && soon(session.states.back().stamp.made)) return;
    JointState& state = session.states.emplace_back();
    read(message.data, Message{&state});
    state.stamp = stamp;
  } else if (is(parts.changes, "/supervision")) {
    StateChange& change = session.changes.emplace_back();
    read(message.data, change);
    if (!change.code) change.code = code_of_words(change.reason);
    change.at = message.log;
  } else if (is(parts.settings, "/operator_settings")) {
    SettingsChange& change = session.settings.emplace_back();
    read(message.data, Message{&change});
    change.at = message.log;
  } else if (is(parts.liquid, "/liquid")) {
    LiquidMessage told;
    LiquidState& liquid = told.liquid;
    liquid.lateral = std::numeric_limits<double>::quiet_NaN();  // not recorded by old versions
    read(message.data, told);
    SessionFile::Liquid& known = session.liquids[told.tool];
    add_felt(message.log, liquid.lateral, parts.felt_period, known.felt);
    add_wave(message.log, liquid, parts.felt_period, known.waves);
    known.spills.see(message.log, liquid, session.settings.empty() ? "" : session.settings.back().profile);
    const bool is_seen = !known.states.empty() && soon(known.states.back().first);
    if (!is_seen || liquid.spilled != known.states.back().second.spilled)
      known.states.emplace_back(message.log, liquid);
  } else if (is(parts.limits, "/active_constraint")) {
    LimitChange& change = session.limits.emplace_back();
    read(message.data, change);
    change.at = message.log;
  } else if (is(parts.statistics, "/statistics")) {
    SessionStatistics& counted = session.statistics.emplace_back();
    read(message.data, Message{&counted});
    counted.now = message.log;
  } else if (is(parts.episodes, "/episode")) {
    EpisodeMark& mark = session.episodes.emplace_back();
    read(message.data, Message{&mark});
    mark.at = message.log;
  } else if (is(parts.episodes, "/scene")) {
    SceneLook& look = session.scenes.emplace_back();
    read(message.data, Message{&look});
    look.scene.at = message.log;
  } else if (is(parts.cells, "/cell")) {
    session.cells.push_back({message.log, read_cell(message)});
  }
}

/// What is taken from the metadata `robot`.
struct RobotNote {
  struct Joint {
    std::string name, type;
  };
  struct Tool {
    std::string name;
  };
  std::vector<Joint> joints;
  std::vector<Tool> tools;  ///< none of older files, which have one
  JointVector velocity_max, acceleration_max;
};
template <typename V>
void describe(V& v, RobotNote::Joint& joint) {
  v.add("name", "", "", joint.name);
  v.add("type", "", "", joint.type);
}
template <typename V>
void describe(V& v, RobotNote::Tool& tool) {
  v.add("name", "", "", tool.name);
}
template <typename V>
void describe(V& v, RobotNote& robot) {
  v.add("joints", "", "", robot.joints);
  v.add("tools", "", "", robot.tools, sized(1, kMaxTools).or_absent());
  v.add("velocity_max", "", "", robot.velocity_max);
  v.add("acceleration_max", "", "", robot.acceleration_max);
}

void read_robot(const std::string& json, SessionFile& session) {
  RobotNote robot;
  read(json, robot);
  for (const RobotNote::Joint& joint : robot.joints) {
    session.names.joints.push_back(joint.name);
    session.names.joint_units.push_back(joint.type == "prismatic" ? "m" : "rad");
  }
  for (const RobotNote::Tool& tool : robot.tools) session.names.tools.push_back(tool.name);
  session.velocity_max = robot.velocity_max;
  session.acceleration_max = robot.acceleration_max;
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
    return Error{fmt::format("{}: has no robot in its metadata; it is not a session of steadyhand", path.string())};
  }
  try {
    read_robot(robot->second.at("json"), session);
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
  const int tools = session.names.tool_count();
  const auto known = [tools](const auto& entry) { return entry.tool < tools; };
  if (!std::all_of(session.steps.begin(), session.steps.end(),
                   [tools](const PlanStep& step) { return step.tool_count == tools; }) ||
      !std::all_of(session.samples.begin(), session.samples.end(), known) ||
      !std::all_of(session.changes.begin(), session.changes.end(), known)) {
    return Error{fmt::format("{}: its robot has {} tool{}, and its messages others", path.string(), tools,
                             tools == 1 ? "" : "s")};
  }
  return session;
}

namespace {

/// Start of the recording, as DATE_TIME in UTC. A program may make several files, all with the program's start in their
/// names. Therefore the file's metadata comes first. A renamed file without metadata started no later than it was
/// written.
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
