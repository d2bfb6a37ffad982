#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/video.hpp"
#include "steadyhand/operator/protocol/operator.hpp"
#include "steadyhand/operator/protocol/policy_hand.hpp"

/// Interface between a session and its clients: facts sent to them, and callbacks for their messages.
namespace steadyhand {

/// Sent to a client once, when it connects.
struct ServerFacts {
  /// An objective, whose weight OperatorRequest::Kind::kWeight may set.
  struct Term {
    std::string name, label, unit;  ///< unit: of its weights
    int count = 1;                  ///< number of its weights
    double min = 0.0, max = 1.0;    ///< range that a page offers
    bool logarithmic = false;       ///< scale by factors from min on, and 0 below
    bool offered = true;            ///< to the operator
  };
  struct Profile {
    std::string name, label;
    std::vector<double> weights;  ///< for each term the largest
    int index = 0;                ///< in `profiles`
  };
  /// As the arm simulates it, m; radius and height are inside.
  struct Glass {
    double radius = 0.0, height = 0.0, fill = 0.0;
  };
  /// Task of a simulated scene.
  struct Task {
    std::string name, instruction;
    double time_limit = 0.0;              ///< s
    std::vector<std::string> conditions;  ///< texts, in the order of TaskProgress::held
    std::vector<std::string> things{};    ///< names of what it looks at, as OperatorView::scene has them
  };
  std::string version;  ///< version of the program
  std::string cell;     ///< JSON as cell_json() makes it
  std::string robot;    ///< JSON as `steadyhand describe` prints it
  int tools = 1;        ///< how many tools it has
  Glass glass;
  std::vector<Term> terms;
  std::vector<Profile> profiles;
  std::optional<Task> task;
  std::vector<std::string> recordings;  ///< built-in hands that OperatorRequest::Kind::kPlayback takes
  std::vector<CameraInfo> cameras;      ///< in the order of VideoPacket::camera
};

template <typename V>
void describe(V& v, ServerFacts::Term& t) {
  v.type("Term", "An objective that the arm's motion is weighed by.");
  v.add("name", "", "", t.name);
  v.add("label", "", "for people", t.label);
  v.add("unit", "", "a weight's unit", t.unit);
  v.add("count", "", "number of its weights", t.count, at_least(1));
  v.group("range", "WeightRange", "weights to choose among", [&](auto& inner) {
    inner.add("min", "", "", t.min);
    inner.add("max", "", "", t.max);
    inner.add("logarithmic", "", "by factors, and 0 at the lower end", t.logarithmic);
  });
  v.add("offered", "", "whether its weight is for the operator to choose", t.offered);
}
template <typename V>
void describe(V& v, ServerFacts::Profile& p) {
  v.type("Profile", "");
  v.add("index", "", "", p.index, at_least(0));
  v.add("name", "", "", p.name);
  v.add("label", "", "for people", p.label);
  v.add("weights", "", "the largest weight of each of `welcome.terms`", p.weights, sized(0, kMaxObjectives));
}
template <typename V>
void describe(V& v, ServerFacts::Glass& g) {
  v.type("GlassSize", "The glass and its liquid.");
  v.add("radius", "m", "inside", g.radius, above(0.0));
  v.add("height", "m", "inside", g.height, above(0.0));
  v.add("fill", "m", "level of liquid", g.fill, above(0.0));
}
template <typename V>
void describe(V& v, ServerFacts::Task& t) {
  v.type("TaskFacts", "The task in a simulated scene.");
  v.add("name", "", "", t.name);
  v.add("instruction", "", "for people", t.instruction);
  v.add("time_limit", "s", "", t.time_limit);
  v.add("conditions", "", "in words", t.conditions);
  v.add("things", "", "what it looks at", t.things, sized(0, kMaxThings));
}
template <typename V>
void describe(V& v, ServerFacts& f) {
  v.add("program", "", "its version", f.version);
  v.add("terms", "", "objectives whose weights can be asked for", f.terms, sized(0, kMaxObjectives));
  v.add("profiles", "", "", f.profiles);
  v.add("recordings", "", "built-in hands that may play", f.recordings);
  v.add("cameras", "", "in the order in which pictures count them", f.cameras);
  v.add("glass", "", "", f.glass);
  v.add("task", "", "null: there is none", f.task, kOrNull);
  v.add("cell", "", "the obstacles around the arm", RawJson{std::string_view(f.cell)}, known_as("Cell").or_null());
  v.add("robot", "", "as `steadyhand describe` prints it", RawJson{std::string_view(f.robot)},
        known_as("Robot").or_null());
}

/// A page that is made when it is asked for.
struct FreshPage {
  std::string body;
  std::string type;                           ///< Content-Type
  bool document = false;                      ///< contains its scripts and styles; shown without rights on this server
  std::shared_ptr<std::FILE> file = nullptr;  ///< its first `size` bytes are the page, in place of `body`
  std::uint64_t size = 0;
};

/// Calls from the server to the session; on_thread, on_pairing and on_fetch may be empty, the others not. All but `now`
/// are called on the server's thread only, one at a time; none may block.
struct ServerCallbacks {
  /// The session's clock. @pre monotonic
  std::function<Time()> now;
  /// Runs first on the server's thread, to set its priority; may be empty.
  std::function<void()> on_thread;
  /// Ten times a second while the server's thread runs; may be empty.
  std::function<void()> on_tick;
  /// An unexpected exception on the server's thread; the thread continues. May be empty.
  std::function<void(const std::string& what)> on_failure;
  /// The hand of the client in control. `stamp.hand`: when it was there, `stamp.made`: when the message arrived, both
  /// of the session's clock. Finite, at most 250 ms old, of a tool that the robot has, in order for each tool; an older
  /// one that releases counts from its arrival.
  std::function<void(const OperatorSample&)> on_sample;
  /// A policy has connected, or (none) disconnected. If this or the next is empty, there are no policies here.
  std::function<Status(std::optional<PolicyInfo>)> on_policy;
  /// The policy's target, made from a state that is at most 0.5 s old.
  std::function<void(const PolicyTarget&)> on_target;
  /// kStop comes from any client, the rest from the client in control. An error is sent to the client that asked.
  std::function<Status(const OperatorRequest&)> on_request;
  /// Another client has control from now on; 0: none has. The arm must disengage.
  std::function<void(std::uint64_t client)> on_lease;
  /// A code was used up: these addresses carry the next one. The loopback's comes first.
  std::function<void(const std::vector<std::string>& urls)> on_pairing;
  /// A paired client asks for `path`, "/sessions" or something below it, unchecked. The answer may come later
  /// and from any thread, even after the server's end; an error is answered as 404 with its message.
  std::function<void(const std::string& path, std::function<void(Result<FreshPage>)> answer)> on_fetch;
  static constexpr int kMaxFetches = 8;       ///< answers on their way at a time
  static constexpr int kMaxFetchesEach = 4;   ///< the same, for one address
  static constexpr int kReservedFetches = 2;  ///< in addition, for the client in control
};

}  // namespace steadyhand
