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

/// Something has to hold for a task to have succeeded. All lengths in the base's frame.
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
  std::string text{};            ///< for people: what has to hold
  double symmetry = 2.0 * M_PI;  ///< rad, by which the thing may be turned and looks the same
};

/// Where something is put when the scene is set up: at random within these bounds.
struct Placing {
  int thing = 0;                          ///< index into Task::things; a free or a mocap body of the scene
  std::array<double, 2> x{}, y{}, yaw{};  ///< m, m, rad: from, to; base frame
  double z = 0.0;                         ///< m
};

/// A geom of the scene that the planner keeps off.
struct KeptOff {
  std::string geom;                              ///< its name in the scene
  double margin = 0.01;                          ///< m
  std::vector<std::string> may_be_touched_by{};  ///< bodies or links of the arm
};

/// One step of how a task is done: the tool, or what it holds, is led to a thing, or the gripper opens or closes.
struct Move {
  std::optional<double> gripper;     ///< 0 open to 1 closed; absent: the tool is led somewhere
  std::optional<int> lead;           ///< index into Task::things of what is led there; absent: the tool
  int to = 0;                        ///< index into Task::things
  Vector3 offset = Vector3::Zero();  ///< m, from there, in the axes of the base turned as `turn` is
  std::array<bool, 2> keep{};        ///< along those axes x, y: stay where it is instead
  std::optional<int> turn;           ///< it is turned about the vertical as that thing; absent: it stays as it is
  double by = 0.0;                   ///< rad, and by so much on
  double symmetry = M_PI;            ///< rad: turned by a whole number of these it is as good
  double speed = 0.4;                ///< m/s, at most
};

/// What is to be done with an arm in a simulated scene with contact, and when it is done.
struct Task {
  std::string name;                     ///< empty: none
  std::string instruction;              ///< in words
  std::string robot;                    ///< whose task it is, unless somebody says another; empty: any
  std::string scene;                    ///< path of the MJCF of what stands around the arm
  std::string tool;                     ///< path of the MJCF whose body `tool` is the arm's tool; empty: its bodies are
  std::vector<std::string> stands_for;  ///< bodies of the arm that the tool's geometry replaces
  std::vector<std::string> things;      ///< names of sites and bodies of the scene, or `tool`, that conditions name
  std::vector<Placing> placings;
  std::vector<Condition> success;  ///< at least one; all have to hold
  double hold = 0.5;               ///< s, for so long
  double time_limit = 60.0;        ///< s
  double apart = 0.0;              ///< m, between any two things that are placed, at least
  std::vector<KeptOff> keeps_off;
  std::vector<std::string> cameras;  ///< of the scene or the tool, by name, that film its episodes
  std::vector<Move> moves;           ///< how a scripted operator does it; none: nobody has said

  /// Index of a thing, if there is one of this name.
  std::optional<int> find(const std::string& thing) const;
};

/// A place for each of Task::placings, drawn from the seed, no two nearer than Task::apart. Fails if a thousand draws
/// find none.
Result<std::vector<Pose>> draw_places(const Task& task, std::uint64_t seed);

/// rad, by which a pose is turned about the base's z: where its x axis points.
double heading(const Pose& X);

/// Whether a condition holds. @param spilled share of the liquid
bool holds(const Condition& condition, const SceneState& scene, double spilled);

/// How a task goes.
struct TaskProgress {
  double time = 0.0;            ///< s since it began, or until it was decided
  std::uint32_t held = 0;       ///< a bit for each of Task::success that holds
  double spilled = 0.0;         ///< share of the liquid, since the scene was set up
  std::optional<bool> success;  ///< once it is decided: done in time, or not
};

/// Decides from the states of a scene whether its task succeeds. One thread.
class TaskJudge {
 public:
  /// The task must outlive it.
  /// @param waits time does not count, and nothing is decided, from a scene's set-up on until begin()
  explicit TaskJudge(const Task& task, bool waits = false) : task_(&task), waits_(waits) {}

  /// Time counts from 0 with the next state, and all is decided afresh.
  void begin() { begins_ = true; }
  bool has_begun() const { return begins_ || begin_; }

  /// A later state begins anew where the scene was set up anew.
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
