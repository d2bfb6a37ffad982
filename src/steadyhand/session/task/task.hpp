#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/session/task/scene_state.hpp"

namespace steadyhand {

/// A condition for the success of a task. All lengths in the base frame.
struct Condition {
  enum class Kind {
    kNear,      ///< thing within `most` (m) of the other, horizontally, and within `height` (m) of it vertically
    kUpright,   ///< the angle between thing's z and the vertical is at most `most` (rad)
    kStill,     ///< thing is no faster than `most` (m/s), and turns no faster than ten times that in rad/s
    kTouches,   ///< thing is in contact with the other
    kApart,     ///< it is not
    kReleased,  ///< the gripper's fingers do not both touch thing
    kAligned,   ///< thing is turned about the vertical by at most `most` (rad) from the other, or from whole `symmetry`
    kSpilled,   ///< at most this share of the liquid has left the glass since the scene was set up
  };
  Kind kind = Kind::kNear;
  int thing = 0, other = 0;  ///< indices into Task::things
  double most = 0.0, height = 0.0;
  std::string text{};            ///< for people: the condition
  double symmetry = 2.0 * M_PI;  ///< rad; the thing looks the same after a turn by this angle
};

/// Random placement of a thing when the scene is set up, within these bounds.
struct Placing {
  int thing = 0;                          ///< index into Task::things; a free or a mocap body of the scene
  std::array<double, 2> x{}, y{}, yaw{};  ///< m, m, rad: from, to; base frame
  double z = 0.0;                         ///< m
};

/// A geom of the scene that the planner avoids.
struct KeptOff {
  std::string geom;                              ///< its name in the scene
  double margin = 0.01;                          ///< m
  std::vector<std::string> may_be_touched_by{};  ///< bodies or links of the arm
};

/// One step of a task: a tool, or an object that it holds, moves to a thing, or its gripper opens or closes.
struct Move {
  std::string tool_name{};           ///< of the robot's tools; empty: the first
  int tool = 0;                      ///< its index, see find_tools
  std::optional<double> gripper;     ///< 0 open to 1 closed; absent: the tool moves
  std::optional<int> lead;           ///< index into Task::things of the object to move there; absent: the tool
  int to = 0;                        ///< index into Task::things
  Vector3 offset = Vector3::Zero();  ///< m, from that thing, in the axes of the base turned as `turn` is
  std::array<bool, 2> keep{};        ///< along those axes x, y: keep the present position instead
  std::optional<int> turn;  ///< it is turned about the vertical like that thing; absent: it keeps its orientation
  double by = 0.0;          ///< rad, turned further by this angle
  double symmetry = M_PI;   ///< rad; a turn by a whole number of these is as good
  double speed = 0.4;       ///< m/s, at most
};

/// A task for an arm in a simulated scene with contact, and its conditions for success.
struct Task {
  std::string name;                     ///< empty: none
  std::string instruction;              ///< in words
  std::string robot;                    ///< name of its robot, unless another is set explicitly; empty: any
  std::string scene;                    ///< path of the scene's MJCF: everything except the arm
  std::string tool;                     ///< path of the MJCF whose body `tool` is the arm's tool; empty: its bodies are
  std::vector<std::string> stands_for;  ///< bodies of the arm that the tool's geometry replaces
  std::vector<std::string> things;      ///< names of sites and bodies of the scene, or `tool`, that conditions name
  std::vector<Placing> placings;
  std::vector<Condition> success;  ///< at least one; all have to hold
  double hold = 0.5;               ///< s, for which they have to hold
  double time_limit = 60.0;        ///< s
  double apart = 0.0;              ///< m, smallest distance between any two placed things
  std::vector<KeptOff> keeps_off;
  std::vector<std::string> cameras;  ///< names of cameras of the scene or the tool that film its episodes
  std::vector<Move> moves;           ///< moves of a scripted operator; empty: none defined

  /// Index of a thing, if there is one of this name.
  std::optional<int> find(const std::string& thing) const;
};

/// Sets Move::tool. Fails on a tool that is none of the robot's. @param tools names
Status find_tools(Task& task, const std::vector<std::string>& tools);

/// Draws a place for each of Task::placings from the seed, no two nearer than Task::apart. Fails if none is found in a
/// thousand draws.
Result<std::vector<Pose>> draw_places(const Task& task, std::uint64_t seed);

/// rad, rotation of a pose about the base's z: the direction of its x axis.
double heading(const Pose& X);

/// True if a condition holds. @param spilled share of the liquid
bool holds(const Condition& condition, const SceneState& scene, double spilled);

/// State of a task.
struct TaskProgress {
  double time = 0.0;            ///< s since it began, or until the decision
  std::uint32_t held = 0;       ///< a bit for each of Task::success that holds
  double spilled = 0.0;         ///< share of the liquid, since the scene was set up
  std::optional<bool> success;  ///< the decision: done in time, or not; absent: not decided yet
};

/// Judges from the states of a scene whether its task succeeds. One thread.
class TaskJudge {
 public:
  /// The task must outlive it.
  /// @param waits after a scene is set up, time does not count and nothing is decided until begin()
  explicit TaskJudge(const Task& task, bool waits = false) : task_(&task), waits_(waits) {}

  /// Time counts from 0 at the next state, and everything is decided again.
  void begin() { begins_ = true; }
  bool has_begun() const { return begins_ || begin_; }

  /// Starts again if the scene was set up again. States must be in order.
  /// @param spilled share of the glass's liquid that has left it so far; a smaller one is that of a fresh glass
  const TaskProgress& update(const SceneState& scene, double spilled);
  const TaskProgress& progress() const { return progress_; }

 private:
  const Task* task_;
  TaskProgress progress_;
  bool waits_ = false, begins_ = false;
  std::optional<std::uint64_t> reset_;
  std::optional<Time> begin_;
  Time all_since_{0};
  bool all_ = false;
  double before_ = 0.0;  ///< spilled share of the state before
};

}  // namespace steadyhand
