#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/operator/protocol/episodes.hpp"
#include "steadyhand/operator/protocol/requests.hpp"
#include "steadyhand/session/live/describe_snapshot.hpp"

/// Data that an operator's page and the program exchange, see docs/reference/protocol.md.
namespace steadyhand {

/// The operator's choices.
struct SessionControls {
  int profile = 0;                               ///< index into the profiles that the server was started with
  std::array<double, kMaxObjectives> weights{};  ///< for each objective the largest
  int objectives = 0;                            ///< entries of weights in use
  double scale = 0.5;                            ///< metres of the tool for each metre of the hand
  double yaw = 0.0;                              ///< turn of the operator's axes about base z, rad
  double tilt = 0.0;                             ///< rad, how far the glass may lean with the hand
  double fill = 0.0;                             ///< m of liquid in the glass
  bool no_spill = false;                         ///< plans spill nothing
  double latency = 0.0;                          ///< s, added on purpose between the hand's gate and the planner
  int playback = -1;                             ///< index of the built-in recording that plays the hand; -1: none
  std::string policy = {};                       ///< name of the connected policy; empty: none
  bool policy_turn = false;                      ///< the policy commands the arm while no person does
};

template <typename V>
void describe(V& v, SessionControls& c) {
  v.type("Controls", "The operator's choices that are in force.");
  v.add("profile", "", "index of `welcome.profiles`", c.profile, at_least(0));
  v.add("playback", "", "index of `welcome.recordings`, which moves the arm; -1: none", c.playback, at_least(-1));
  v.add("policy", "", "name of the one that is connected; empty: none", c.policy);
  v.add("policy_turn", "", "it moves the arm whenever no person does", c.policy_turn);
  v.add("weights", "", "the largest weight of each of `welcome.terms`",
        std::span(c.weights).first(static_cast<std::size_t>(c.objectives)), sized(0, kMaxObjectives));
  v.add("scale", "", "metres of the tool for each metre of the hand", c.scale);
  v.add("yaw", "rad", "turn of the operator's axes about the base's z", c.yaw);
  v.add("tilt", "rad", "how far the glass may lean with the hand", c.tilt);
  v.add("fill", "m", "level of liquid in the glass", c.fill);
  v.add("no_spill", "", "plans spill nothing", c.no_spill);
  v.add("latency", "s", "added on purpose between the hand's gate and the planner", c.latency, at_least(0.0));
}

/// Progress of a simulated scene's task, and where its things are.
struct TaskView {
  TaskProgress progress;
  std::span<const ThingState> things;
};
template <typename V>
void describe(V& v, TaskView& t) {
  v.type("TaskProgress", "How the task of a simulated scene goes.");
  v.add("time", "s", "since the first grip after the scene was set up, or since an episode began", t.progress.time);
  v.add("held", "", "a bit for each of `welcome.task.conditions`", t.progress.held);
  v.add("spilled", "", "share of the liquid", t.progress.spilled);
  v.add("success", "", "null: not decided", t.progress.success, kOrNull);
  const auto place = [](const ThingState& thing) {
    const Pose& at = thing.X_base_thing;
    return std::array{at.p.x(), at.p.y(), at.p.z(), at.q.x(), at.q.y(), at.q.z(), at.q.w()};
  };
  v.add("things", "", "x, y, z (m) and quaternion of each of `welcome.task.things`, base frame",
        t.things | std::views::transform(place), sized(0, kMaxThings).or_null());
}

/// A session as its operator sees it; the server sends it to every client.
struct OperatorView : SessionSnapshot {
  static constexpr std::string_view kType = "state";
  SessionControls controls;
  bool recording = false;
  std::optional<TaskProgress> task;  ///< task of the simulated scene; none: no task
  SceneState scene;                  ///< scene of that task; no things: not known
  EpisodeView episode;
  std::shared_ptr<const std::string> cell;  ///< obstacles, as ServerFacts::cell; null: as that
  /// For each of ServerFacts::cameras why no more frames come; empty: they do. Null: all cameras send frames.
  std::shared_ptr<const std::vector<std::string>> cameras_ended;
};
template <typename V>
void describe(V& v, OperatorView& s) {
  v.type("StateMessage", "one look at the session, about 60 times a second");
  describe(v, static_cast<SessionSnapshot&>(s));
  v.add("recording", "", "the session is being recorded", s.recording);
  std::optional<TaskView> task;
  if (s.task) task = TaskView{*s.task, std::span(s.scene.thing).first(static_cast<std::size_t>(s.scene.things))};
  v.add("task", "", "null: there is none", task, kOrNull);
  v.add("episode", "", "the one that runs, or ran last", s.episode);
  v.add("controls", "", "as they are in force", s.controls);
}

}  // namespace steadyhand
