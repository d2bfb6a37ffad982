#pragma once

#include <span>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/json_writer.hpp"
#include "steadyhand/core/video.hpp"
#include "steadyhand/files/record/episode_mark.hpp"
#include "steadyhand/files/record/settings_change.hpp"
#include "steadyhand/files/record/statistics.hpp"
#include "steadyhand/files/record/step.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/planning/plan/active_constraint.hpp"
#include "steadyhand/session/supervise/state.hpp"

/// The arrow structs as JSON, one object each, in SI units; schemas.hpp describes them. Numbers are the shortest that
/// read back the same; those that are not finite become null, since JSON has no word for them.
namespace steadyhand {

void append_json(JsonBuffer& out, const OperatorSample& sample);
void append_json(JsonBuffer& out, const Target& target);
void append_json(JsonBuffer& out, const Reference& reference);
/// @param path X_base_tool at the plan's nodes, so that a viewer can draw the plan; may be empty
void append_json(JsonBuffer& out, const Plan& plan, std::span<const Pose> path);
void append_json(JsonBuffer& out, const JointCommand& command);
void append_json(JsonBuffer& out, const JointState& state);
void append_json(JsonBuffer& out, const PlanStep& step, const RunNames& names);
void append_json(JsonBuffer& out, const SupervisionChange& change);
void append_json(JsonBuffer& out, const SettingsChange& change);
void append_json(JsonBuffer& out, Time at, const LiquidState& liquid);
void append_json(JsonBuffer& out, Time at, const ActiveConstraint& constraint);
void append_json(JsonBuffer& out, Time at, const Cell& cell);
void append_json(JsonBuffer& out, const SessionStatistics& statistics);
void append_json(JsonBuffer& out, const EpisodeMark& mark);
void append_json(JsonBuffer& out, const SceneLook& look);
/// @param camera its name
void append_json(JsonBuffer& out, const VideoPacket& picture, std::string_view camera);

}  // namespace steadyhand
