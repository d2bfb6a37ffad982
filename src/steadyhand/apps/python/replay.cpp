#include "steadyhand/report/replay/replay.hpp"

#include <fmt/format.h>
#include <nanobind/stl/map.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>

#include "steadyhand/apps/python/objective.hpp"
#include "steadyhand/apps/python/options.hpp"
#include "steadyhand/apps/python/robot.hpp"
#include "steadyhand/files/input/sample_list.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "steadyhand/report/figures/past_session.hpp"

namespace steadyhand::python {

namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();

/// A hand's motion, and what its operator changed on the way.
struct Hand {
  Recording recording;
  std::vector<SettingsChange> changes;
  std::vector<CellChange> cells;
  std::size_t not_followed = 0;  ///< samples that the gate did not trust
};

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// ---- Columns of numpy arrays: one entry for each item.
template <typename Items, typename Entry>
nb::object numbers(const Items& items, const Entry& entry) {
  double* data = nullptr;
  nb::object array = make_array({items.size()}, data);
  for (const auto& item : items) *data++ = static_cast<double>(entry(item));
  return array;
}
template <typename Items, typename Entry>
nb::object vectors(const Items& items, std::size_t columns, const Entry& entry) {
  double* data = nullptr;
  nb::object array = make_array({items.size(), columns}, data);
  for (const auto& item : items) {
    const auto& vector = entry(item);
    for (std::size_t i = 0; i < columns; ++i) *data++ = vector[static_cast<Eigen::Index>(i)];
  }
  return array;
}
template <typename Items, typename Entry>
nb::object poses(const Items& items, const Entry& entry) {
  double* data = nullptr;
  nb::object array = make_array({items.size(), 4, 4}, data);
  for (const auto& item : items) {
    const Pose pose = entry(item);
    write_pose(pose.p, pose.q.toRotationMatrix(), data);
    data += 16;
  }
  return array;
}

/// entry(item, t) fills the numbers of tool t, an array of this shape. Several tools add an axis behind the items'.
template <typename Items, typename Entry>
nb::object of_tools(const Items& items, int tools, const std::vector<std::size_t>& shape, const Entry& entry) {
  std::vector<std::size_t> whole{items.size()};
  if (tools > 1) whole.push_back(static_cast<std::size_t>(tools));
  whole.insert(whole.end(), shape.begin(), shape.end());
  std::size_t size = 1;
  for (const std::size_t length : shape) size *= length;
  double* data = nullptr;
  nb::object array = make_array(whole, data);
  for (const auto& item : items) {
    for (int t = 0; t < tools; ++t, data += size) entry(item, t, data);
  }
  return array;
}
template <typename Items>
nb::object grippers(const Items& items, int tools) {
  return of_tools(items, tools, {},
                  [](const auto& item, int t, double* data) { *data = item.gripper[t].value_or(kNone); });
}

nb::dict columns_of(const std::vector<OperatorSample>& samples) {
  nb::dict columns;
  columns["t"] = numbers(samples, [](const auto& s) { return to_seconds(s.stamp.hand); });
  columns["T_operator_hand"] = poses(samples, [](const auto& s) { return s.X_operator_hand; });
  columns["clutch"] = numbers(samples, [](const auto& s) { return s.clutch; });
  columns["tracked"] = numbers(samples, [](const auto& s) { return s.tracked; });
  columns["gripper"] = numbers(samples, [](const auto& s) { return s.gripper.value_or(kNone); });
  nb::list leaders;
  for (const OperatorSample& sample : samples) leaders.append(to_text(to_string(sample.leader)));
  columns["leader"] = leaders;
  columns["intervention"] = numbers(samples, [](const auto& s) { return s.intervention; });
  columns["tool"] = numbers(samples, [](const auto& s) { return s.tool; });
  return columns;
}

nb::dict columns_of(const std::vector<JointCommand>& commands, std::size_t n, int tools) {
  nb::dict columns;
  columns["t"] = numbers(commands, [](const auto& c) { return to_seconds(c.stamp.made); });
  columns["q"] = vectors(commands, n, [](const auto& c) -> const auto& { return c.q; });
  columns["dq"] = vectors(commands, n, [](const auto& c) -> const auto& { return c.dq; });
  columns["ddq"] = vectors(commands, n, [](const auto& c) -> const auto& { return c.ddq; });
  columns["gripper"] = grippers(commands, tools);
  return columns;
}

nb::dict columns_of(const std::vector<JointState>& states, std::size_t n, int tools) {
  nb::dict columns;
  columns["t"] = numbers(states, [](const auto& s) { return to_seconds(s.stamp.made); });
  columns["q"] = vectors(states, n, [](const auto& s) -> const auto& { return s.q; });
  columns["dq"] = vectors(states, n, [](const auto& s) -> const auto& { return s.dq; });
  columns["gripper"] = grippers(states, tools);
  return columns;
}

/// By name a column; not a number where an object was not there.
nb::dict object_distances(const std::vector<PlanStep>& steps) {
  nb::dict columns;
  std::map<std::string, double*> rows;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    for (const auto& [name, distance] : steps[i].object_distances) {
      double*& row = rows[name];
      if (row == nullptr) {
        columns[to_text(name)] = make_array({steps.size()}, row);
        std::fill_n(row, steps.size(), std::numeric_limits<double>::quiet_NaN());
      }
      row[i] = distance;
    }
  }
  return columns;
}

nb::dict columns_of(const std::vector<PlanStep>& steps, const RunNames& names) {
  const std::size_t n = names.joints.size();
  nb::dict columns;
  columns["t"] = numbers(steps, [](const auto& s) { return s.t_s; });
  const int tools = names.tool_count();
  const auto poses_of = [&](Pose ToolStep::*pose) {
    return of_tools(steps, tools, {4, 4}, [pose](const PlanStep& s, int t, double* data) {
      write_pose((s.tools[t].*pose).p, (s.tools[t].*pose).q.toRotationMatrix(), data);
    });
  };
  columns["T_base_target"] = poses_of(&ToolStep::X_base_target);
  columns["T_base_tool"] = poses_of(&ToolStep::X_base_planned);
  columns["q"] = vectors(steps, n, [](const auto& s) -> const auto& { return s.q; });
  columns["dq"] = vectors(steps, n, [](const auto& s) -> const auto& { return s.dq; });
  columns["ddq"] = vectors(steps, n, [](const auto& s) -> const auto& { return s.ddq; });
  columns["local_acceleration"] = of_tools(steps, tools, {3}, [](const PlanStep& s, int t, double* data) {
    std::copy_n(s.tools[t].local_acceleration.data(), 3, data);
  });
  columns["objective"] = numbers(steps, [](const auto& s) { return s.objective; });
  nb::dict shares;
  for (std::size_t i = 0; i < names.terms.size(); ++i)
    shares[to_text(names.terms[i])] = numbers(steps, [i](const auto& s) { return s.shares[i]; });
  columns["shares"] = shares;
  columns["iterations"] = numbers(steps, [](const auto& s) { return s.iterations; });
  columns["solve_us"] = numbers(steps, [](const auto& s) { return s.solve_time_us; });
  nb::list status;
  for (const PlanStep& step : steps) status.append(to_text(to_string(step.status)));
  columns["status"] = status;
  columns["clearance"] = numbers(steps, [](const auto& s) { return s.smallest_sphere_distance_m; });
  columns["engaged"] =
      of_tools(steps, tools, {}, [](const PlanStep& s, int t, double* data) { *data = s.tools[t].engaged; });
  columns["object_distances"] = object_distances(steps);
  return columns;
}

/// Poses of things by their index, as many as the first look has.
nb::dict columns_of(const std::vector<SceneLook>& looks) {
  nb::dict columns;
  columns["t"] = numbers(looks, [](const auto& s) { return to_seconds(s.scene.at); });
  columns["reset"] = numbers(looks, [](const auto& s) { return static_cast<double>(s.scene.reset); });
  columns["spilled"] = numbers(looks, [](const auto& s) { return s.progress.spilled; });
  columns["success"] = numbers(looks, [](const auto& s) {
    return s.progress.success ? double(*s.progress.success) : std::numeric_limits<double>::quiet_NaN();
  });
  nb::list things;
  for (int i = 0; i < (looks.empty() ? 0 : looks[0].scene.things); ++i) {
    things.append(poses(looks, [i](const auto& s) { return s.scene.thing[i].X_base_thing; }));
  }
  columns["things"] = things;
  return columns;
}

// ---- Hands.
Hand through_gate(Recording recording) {
  Hand hand{std::move(recording), {}, {}, 0};
  hand.not_followed = pass_gate(hand.recording, {});
  return hand;
}

RecordingOptions range(const std::string& track, double from, double until) {
  return {track, from, until > 0.0 ? until : kForever};
}

Hand load_hand(const std::string& path, const std::string& track, double from, double until,
               const std::vector<std::string>& tools) {
  const Unlocked unlocked;
  RecordingOptions options = range(track, from, until);
  options.tools = tools;
  return through_gate(value_of(load_recording(path, options)));
}

Hand make_hand(const Row& t, const Matrices4& T, const Row& clutch, const Row& tool) {
  SampleList samples;
  for (std::size_t i = 0; i < t.shape(0); ++i) {
    const std::string where = fmt::format("recording[{}]", i);
    const Pose pose = to_pose(T.data() + 16 * i, (where + ": T_operator_hand").c_str());
    if (tool(i) < 0 || tool(i) >= kMaxTools)
      throw Refused(fmt::format("{}: tool is {}; it must be 0 or 1", where, tool(i)));
    check(samples.add({t(i), pose.p, pose.q, clutch(i) != 0.0}, where, static_cast<int>(tool(i))));
  }
  return through_gate({"arrays", "", value_of(std::move(samples).take(0.0, kForever, "recording"))});
}

Hand load_session_hand(const std::string& path, double from, double until, bool accept_emulated) {
  const Unlocked unlocked;
  SessionParts parts;
  parts.samples = parts.settings = parts.cells = true;
  HandGateSettings gate;
  gate.accept_emulated = accept_emulated;
  SessionHand hand = value_of(hand_of_session(value_of(load_session(path, parts)), range("", from, until), gate));
  return {std::move(hand.recording), std::move(hand.changes), std::move(hand.cells), 0};
}

nb::dict run_replay(const Hand& hand, const Robot& robot, const std::string& profile, const nb::dict& options) {
  ReplaySettings settings;
  settings.pipeline = pipeline_settings(*robot.model, profile, options);
  settings.changes = hand.changes;
  if (!options.contains("cell_fixed")) settings.cells = hand.cells;
  settings.cell = nb::cast<const Cell&>(options["cell"]);
  if (options.contains("yaw_fixed"))
    for (SettingsChange& change : settings.changes) change.yaw = settings.pipeline.retarget.yaw;
  if (options.contains("scale_fixed"))
    for (SettingsChange& change : settings.changes) change.scale = settings.pipeline.retarget.scale;
  if (options.contains("weights_fixed"))
    for (SettingsChange& change : settings.changes) change.keep_profile();
  // Ctrl-C and exceptions of an objective end it: a user need not wait for the rest of an hour's recording.
  auto looked = std::chrono::steady_clock::now();
  ReplayTaps taps;
  taps.progress = [&](double) {
    if (const auto now = std::chrono::steady_clock::now(); now - looked < std::chrono::milliseconds(50)) return;
    const Locked locked;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    raise_errors(settings.pipeline.ocp.objectives);
    looked = std::chrono::steady_clock::now();
  };
  const ReplayResult result = [&] {
    const Unlocked unlocked;
    return value_of(replay(*robot.model, hand.recording, settings, taps));
  }();
  raise_errors(settings.pipeline.ocp.objectives);
  const RunNames names = run_names(*robot.model, settings.pipeline.ocp.objectives);
  nb::dict answer;
  answer["steps"] = columns_of(result.steps, names);
  answer["commands"] = columns_of(result.commands, names.joints.size(), names.tool_count());
  return answer;
}

// ---- Sessions.
nb::dict read_session(const std::string& path) {
  const SessionFile session = [&] {
    const Unlocked unlocked;
    SessionParts parts;
    parts.samples = parts.steps = parts.commands = parts.states = parts.changes = parts.settings = parts.episodes =
        true;
    return value_of(load_session(path, parts));
  }();
  const std::size_t n = session.names.joints.size();
  nb::dict answer;
  answer["name"] = session.name;
  answer["complete"] = session.overview.complete;
  answer["duration"] = session.overview.any ? session.duration() : 0.0;
  answer["metadata"] = nb::cast(session.overview.metadata);
  answer["joint_names"] = nb::tuple(nb::cast(session.names.joints));
  answer["tool_names"] = nb::tuple(nb::cast(session.names.tools));
  answer["joint_units"] = nb::tuple(nb::cast(session.names.joint_units));
  answer["velocity_max"] = from_vector(session.velocity_max);
  answer["acceleration_max"] = from_vector(session.acceleration_max);
  answer["samples"] = columns_of(session.samples);
  answer["steps"] = columns_of(session.steps, session.names);
  answer["commands"] = columns_of(session.commands, n, session.names.tool_count());
  answer["states"] = columns_of(session.states, n, session.names.tool_count());
  nb::list changes;
  for (const SessionFile::Change& change : session.changes)
    changes.append(nb::make_tuple(to_seconds(change.at), change.from, change.to, change.reason, change.tool));
  answer["changes"] = changes;
  nb::list settings;
  for (const SettingsChange& change : session.settings)
    settings.append(nb::make_tuple(to_seconds(change.at), nb::cast(change.weights), change.scale, change.yaw));
  answer["settings"] = settings;
  nb::list episodes;
  for (const EpisodeMark& mark : session.episodes) {
    episodes.append(nb::make_tuple(to_seconds(mark.at), mark.episode, to_text(to_string(mark.kind)),
                                   mark.success ? nb::cast(*mark.success) : nb::none(), to_text(mark.task),
                                   to_text(mark.notes)));
  }
  answer["episodes"] = episodes;
  answer["scenes"] = columns_of(session.scenes);
  nb::list lost;
  for (const McapLoss& loss : session.overview.lost)
    lost.append(nb::make_tuple(to_seconds(loss.first), to_seconds(loss.last), to_text(loss)));
  answer["lost"] = lost;
  return answer;
}

/// Topic and bytes of each message whose topic begins with `topics`; for each topic, its channel's metadata.
nb::tuple read_messages(const std::string& path, const std::string& topics) {
  std::vector<std::pair<std::string, std::string>> messages;
  std::map<std::string, std::map<std::string, std::string>> about;
  {
    const Unlocked unlocked;
    value_of(read_mcap(path, [&](const McapMessage& message) -> Status {
      if (!message.topic.starts_with(topics)) return Done{};
      messages.emplace_back(message.topic, message.data);
      about.try_emplace(messages.back().first, *message.channel_metadata);
      return Done{};
    }));
  }
  nb::list found;
  for (const auto& [topic, data] : messages) found.append(nb::make_tuple(topic, nb::bytes(data.data(), data.size())));
  return nb::make_tuple(nb::cast(about), found);
}

/// The metadata `run`, without the messages.
std::map<std::string, std::string> session_run(const std::string& path) {
  const Unlocked unlocked;
  const SessionFile session = value_of(load_session(path, {}));
  const auto run = session.overview.metadata.find("run");
  return run == session.overview.metadata.end() ? std::map<std::string, std::string>{} : run->second;
}

}  // namespace

void bind_replay(nb::module_& module) {
  nb::class_<Hand>(module, "Hand")
      .def_prop_ro("name", [](const Hand& hand) { return hand.recording.name; })
      .def_ro("not_followed", &Hand::not_followed)
      .def_prop_ro("columns", [](const Hand& hand) { return columns_of(hand.recording.samples); });
  module.def("load_hand", &load_hand);
  module.def("make_hand", &make_hand);
  module.def("load_session_hand", &load_session_hand);
  module.def("replay", &run_replay);
  module.def("read_session", &read_session);
  module.def("session_run", &session_run);
  module.def("read_messages", &read_messages);
  module.attr("live_ramp") = kLiveRamp;
  module.def("is_session", [](const std::string& path) { return is_mcap(path); });
}

}  // namespace steadyhand::python
