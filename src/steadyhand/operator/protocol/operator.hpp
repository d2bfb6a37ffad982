#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/operator/protocol/episodes.hpp"
#include "steadyhand/session/live/live_taps.hpp"

/// What an operator's page and the program tell each other, see docs/reference/protocol.md.
namespace steadyhand {

/// What an operator asks for beside moving the hand. Any client may stop; the rest needs the lease.
struct OperatorRequest {
  enum class Kind : std::uint8_t {
    kStop,      ///< bring the arm to rest now
    kReset,     ///< after a stop or a fault: ready again, where the arm stands
    kProfile,   ///< `text`: its name
    kWeight,    ///< `text`: name of an objective, `value`: its largest weight, >= 0; its others keep their ratio
    kScale,     ///< `value`: metres of the tool for each metre of the hand, > 0
    kYaw,       ///< `value`: turn of the operator's frame, rad
    kTilt,      ///< `value`: how far the glass may lean with the hand, rad, 0 to pi
    kFill,      ///< `value`: how high the glass is filled, m
    kRefill,    ///< a full glass, at the level that it has; the arm goes on
    kRate,      ///< `value`: planning steps a second, Hz
    kLatency,   ///< `value`: s, added on purpose between the hand's gate and the planner
    kPlayback,  ///< `text`: name of a built-in recording to take as the hand; empty: end it
    kPolicy,    ///< `value` 0 or 1: whether the policy that is connected has its turn
    kRecord,    ///< `value` 0 or 1: whether the session is recorded
    kObject,    ///< `text`: name of what stands around the arm; `object`: from now on there, none: no longer
    kAttach,    ///< `text`: name of an object that the tool takes where it is
    kDetach,    ///< the same: it lets go of it
    kEpisode,   ///< `text`: begin, keep, discard or mark; `episode`: what else is said of it
    kSetUp,     ///< the simulated scene anew; `value`: the seed of its places, -1: the next
    kLabel,     ///< `text`: name of a recorded session, `to`: what people call it; empty: nothing
    kRename,    ///< `text`: name of a recorded session, `to`: its new name
    kDelete,    ///< `text`: name of a recorded session that is to go
  };
  Kind kind = Kind::kStop;
  std::string text;
  double value = 0.0;
  std::optional<CellObject> object = std::nullopt;
  std::string to = {};
  EpisodeMark episode = {};
};

/// What the operator has chosen.
struct SessionControls {
  int profile = 0;                               ///< index into the profiles that the server was started with
  std::array<double, kMaxObjectives> weights{};  ///< of each objective the largest
  int objectives = 0;                            ///< entries of weights in use
  double scale = 0.5;                            ///< metres of the tool for each metre of the hand
  double yaw = 0.0;                              ///< turn of the operator's axes about base z, rad
  double tilt = 0.0;                             ///< rad, how far the glass may lean with the hand
  double fill = 0.0;                             ///< m of liquid in the glass
  bool no_spill = false;                         ///< plans spill nothing
  double latency = 0.0;                          ///< s, added on purpose between the hand's gate and the planner
  int playback = -1;                             ///< index of the built-in recording that plays the hand; -1: none
  std::string policy = {};                       ///< name of the one that is connected; empty: none
  bool policy_turn = false;                      ///< it leads the arm wherever no person does
};

/// A session as its operator sees it; the server sends it to every client.
struct OperatorView : SessionSnapshot {
  SessionControls controls;
  bool recording = false;
  std::optional<TaskProgress> task;  ///< of the simulated scene; none: there is no task
  SceneState scene;                  ///< of that task; no things: not known
  EpisodeView episode;
  std::shared_ptr<const std::string> cell;  ///< what stands around the arm, as ServerFacts::cell; null: as that
  /// Of each of ServerFacts::cameras why no more pictures come, empty: they do; null: of all of them they do.
  std::shared_ptr<const std::vector<std::string>> cameras_ended;
};

}  // namespace steadyhand
