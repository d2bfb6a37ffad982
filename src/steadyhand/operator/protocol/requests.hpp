#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "steadyhand/core/describe.hpp"
#include "steadyhand/files/record/episode_mark.hpp"
#include "steadyhand/geometry/collision/shape_names.hpp"
#include "steadyhand/geometry/robot/cell.hpp"

/// Requests of clients, as docs/reference/protocol.md has it.
namespace steadyhand {

// A hand that is further away than this, or a clock that far from its zero, is a mistake.
constexpr double kFarthest = 1000.0;     // m
constexpr double kLongest = 1e9;         // s
constexpr double kLargestRequest = 1e6;  // weights, scale, yaw, rate

/// Requests of an operator, in addition to moving the hand. Any client may stop; the rest needs control.
struct OperatorRequest {
  enum class Kind : std::uint8_t {  ///< names_of says what each does
    kStop,
    kReset,
    kProfile,
    kWeight,
    kScale,
    kYaw,
    kTilt,
    kFill,
    kRefill,
    kRate,
    kLatency,
    kPlayback,
    kPolicy,
    kRecord,
    kObject,
    kAttach,
    kDetach,
    kEpisode,
    kSetUp,
    kLabel,
    kRename,
    kDelete,
  };
  Kind kind = Kind::kStop;
  std::string text;
  double value = 0.0;
  std::optional<CellObject> object = std::nullopt;
  std::string to = {};
  EpisodeMark episode = {};
  int tool = 0;  ///< index of the tool that takes an object
};

constexpr auto names_of(OperatorRequest::Kind) {
  using enum OperatorRequest::Kind;
  return named(
      "RequestKind",
      {Name{kStop, "stop", "from any client: the arm stops at once"},
       Name{kReset, "reset", "after a stop or a fault, from the client that has control"},
       Name{kProfile, "profile",
            "Weights, prediction and tilt change while the arm moves. If the profile differs in any other key, the "
            "hand is released, and the whole profile takes effect when the arm has stopped; grip again then. Refused "
            "in a policy's turn if the arm must stop for it"},
       Name{kWeight, "weight",
            "its largest weight. Its other weights keep the ratios that the profile gives them. `velocity` counts as "
            "at least 0.02 ([profiles.md](profiles.md#weights))"},
       Name{kScale, "scale", "how far the tool moves with the hand"},
       Name{kYaw, "yaw", "turn of the operator's axes about the base's z"},
       Name{kTilt, "tilt",
            "how far the glass may lean with the hand, 0 (upright) to pi (all of it: a profile that spills nothing "
            "then does not count the liquid)"},
       Name{kFill, "fill", "how high the glass is filled; fresh liquid"},
       Name{kRefill, "refill",
            "a full glass at the current level, as if it was just poured; the arm continues. Nothing changes where the "
            "tool holds no glass"},
       Name{kRate, "rate", "planning steps a second; up to the arm's rate; 0: what the machine sustains"},
       Name{kLatency, "latency",
            "added on purpose between the hand's gate and the planner, 0 to 1; a release acts at once all the same"},
       Name{kPlayback, "playback",
            "one of `welcome.recordings` moves the arm, repeatedly, until control ends or the arm is stopped; "
            "empty: none. Refused while the arm is stopped"},
       Name{kPolicy, "policy",
            "1: the policy that is connected has its turn, until a person takes over, 0, a stop, or control's end. "
            "Refused while the arm is stopped or an operator moves it"},
       Name{kRecord, "record",
            "0 or 1. A recording that began less than 2 s ago ends 2 s after its begin, and continues if 1 follows "
            "until then. 0 is refused in an episode"},
       Name{kObject, "object",
            "the obstacle of this name from now on (it is added, or moves); `null`: it is removed. Its colour and what "
            "may touch it stay"},
       Name{kAttach, "attach",
            "a tool takes the object of this name where it is: from now on it moves with the arm, as a part of it. "
            "Refused for an unknown name, a half-space, or an object in the arm"},
       Name{kDetach, "detach", "the tool that carries it releases it where it is"},
       Name{kEpisode, "episode",
            "an episode for a data set begins, ends wanted or unwanted (also changed afterwards), or gets remarks "
            "only. `begin` is refused within an episode and where the session is not recorded; "
            "everything else once the recording that the episode began in has ended"},
       Name{kSetUp, "set_up",
            "the simulated scene again, its things where this seed has them; without one: the next. Not in an episode"},
       Name{kLabel, "label",
            "the label of the recorded session `text`; empty: none. At most 120 bytes; next to the file, in "
            "`NAME.label`"},
       Name{kRename, "rename",
            "its new name: letters, digits, `-`, `_`, `.`. Refused if another recording has it, also if two renames to "
            "one name are under way"},
       Name{kDelete, "delete", "it is deleted. Not the one that is being recorded, which is not renamed either"}});
}

/// Position and size of an object.
struct PlacedShape {
  ShapeKind kind = ShapeKind::kSphere;
  double radius = 0.0, length = 0.0, rounding = 0.0;  ///< m
  Vector3 size = Vector3::Zero();                     ///< m
  Pose X_base_shape;
  std::optional<Vector3> velocity;  ///< m/s
  double margin = 0.01;             ///< m

  Shape shape() const;
  CellObject object(const std::string& name) const;
};
template <typename V>
void describe(V& v, PlacedShape& s) {
  v.type("PlacedShape", "Where an object stands and how large it is.");
  v.add("p", "m", "in the base's frame", s.X_base_shape.p, within(-kFarthest, kFarthest));
  v.add("q", "", "", s.X_base_shape.q);
  v.add("margin", "m", "absent: 0.01", s.margin, within(0.0, 1.0).or_absent());
  v.add("velocity", "m/s", "absent: 0", s.velocity, within(-kFarthest, kFarthest));
  v.choose("shape", "", s.kind, [&](ShapeKind kind) {
    if (kind == ShapeKind::kBox) {
      v.add("size", "m", "", s.size, up_to(kFarthest));
      v.add("rounding", "m", "radius of its edges; absent: 0", s.rounding, within(0.0, kFarthest).or_absent());
    } else if (kind != ShapeKind::kHalfSpace) {
      v.add("radius", "m", "", s.radius, up_to(kFarthest));
      if (kind != ShapeKind::kSphere) v.add("length", "m", "", s.length, within(0.0, kFarthest));
    }
  });
  if (const Status good = check(s.shape()); !good) v.check(false, good.error().message);
}

template <typename V>
void describe(V& v, OperatorRequest& r) {
  using Kind = OperatorRequest::Kind;
  const auto text = [&](const char* what, std::size_t least = 0, std::size_t most = 64) {
    v.add("text", "", what, r.text, sized(least, most));
  };
  const auto value = [&](const char* unit, const char* what, const Limits& limits = within(0.0, kLargestRequest)) {
    v.add("value", unit, what, r.value, limits);
  };
  v.choose("kind", "what is asked for", r.kind, [&](Kind kind) {
    switch (kind) {
      case Kind::kStop:
      case Kind::kReset:
      case Kind::kRefill:
        return;
      case Kind::kProfile:
        return text("one of `welcome.profiles` by name");
      case Kind::kWeight:
        text("one of `welcome.terms` by name");
        return value("", "");
      case Kind::kScale:
        return value("", "metres of the tool for each metre of the hand", up_to(kLargestRequest));
      case Kind::kYaw:
        return value("rad", "", within(-kLargestRequest, kLargestRequest));
      case Kind::kTilt:
        return value("rad", "");
      case Kind::kFill:
        return value("m", "");
      case Kind::kRate:
        return value("Hz", "");
      case Kind::kLatency:
        return value("s", "");
      case Kind::kPolicy:
      case Kind::kRecord:
        return value("", "0 or 1", within(0.0, 1.0));
      case Kind::kPlayback:
        return text("one of `welcome.recordings`, or empty");
      case Kind::kObject: {
        text("its name", 1);
        std::optional<PlacedShape> placed;
        v.add("object", "", "null: it has gone", placed, kOrNull);
        if (placed) r.object = placed->object(r.text);
        return;
      }
      case Kind::kAttach:
        text("its name", 1);
        return v.add("tool", "", "index of the tool; absent: 0", r.tool, within(0, kMaxTools - 1).or_absent());
      case Kind::kDetach:
        return text("its name", 1);
      case Kind::kEpisode:
        v.add("text", "", "what to do", r.episode.kind);
        v.add("success", "", "absent: as the simulated task says", r.episode.success);
        v.add("task", "", "what is to be done, in words", r.episode.task, sized(0, 256).or_absent());
        v.add("notes", "", "any number of lines", r.episode.notes, sized(0, 1000).or_absent().with_lines());
        return;
      case Kind::kSetUp:
        r.value = -1.0;
        return value("", "the seed", within(0.0, kLargestRequest).or_absent());
      case Kind::kLabel:
      case Kind::kRename:
        text("a recorded session", 0, 128);
        v.add("to", "", kind == Kind::kLabel ? "its label" : "its new name", r.to, sized(0, 128));
        return;
      case Kind::kDelete:
        return text("a recorded session", 0, 128);
    }
  });
}

}  // namespace steadyhand
