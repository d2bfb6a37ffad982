#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <ranges>
#include <span>

#include "steadyhand/core/describe.hpp"
#include "steadyhand/core/histogram.hpp"
#include "steadyhand/session/live/live_taps.hpp"

namespace steadyhand {

/// The liquid of a tool in the message `state`.
template <typename V>
void describe_liquid(V& v, LiquidState& liquid) {
  v.add("tilt", "rad", "angles of the surface's normal about x and y", std::array{liquid.tilt_x, liquid.tilt_y},
        kOrNull);
  v.add("freeboard", "m", "from the surface's highest point to the rim", liquid.freeboard, kOrNull);
  v.add("spilled", "", "stays true until the arm is engaged again, is reset, or the glass is refilled", liquid.spilled);
  v.add("spilled_share", "", "share of the liquid", liquid.spilled_share);
  v.add("least_freeboard", "m", "since the glass was filled", liquid.least_freeboard, kOrNull);
  v.add("lateral", "m/s^2", "lateral specific force on it, the largest of the last 20 ms", liquid.lateral, kOrNull);
}

template <typename V>
void describe(V& v, ToolSnapshot& t) {
  v.type("Tool", "A tool, and the hand that moves it.");
  v.add("state", "", "whether it follows its hand", t.state);
  v.add("reason", "", "why, for people: its words may change", t.reason);
  v.add("reason_code", "", "the event that caused the state", t.cause.code);
  v.add("reason_leader", "", "whose hand was on the clutch then", t.cause.leader);
  v.add("pose", "", "where the controlled frame is, in the base", t.X_base_tool);
  v.add("target", "", "where the operator wants it; without a grip, where it is", t.target.X_base_tool);
  v.add("engaged", "", "it is to follow the target", t.target.engaged);
  std::optional<Leader> leader;
  if (t.state == SupervisionState::kEngaged || t.state == SupervisionState::kHolding) leader = t.target.leader;
  v.add("leader", "", "whose hand it follows; null: none", leader, kOrNull);
  v.add("local_acceleration", "m/s^2", "specific force on the glass, in its frame", t.local_acceleration, kOrNull);
  v.add("tracking_error", "m", "target to tool; null without a grip", t.tracking_error, kOrNull);
  v.add("gripper", "", "measured, 0 open to 1 closed; null: it is none", t.gripper, within(0.0, 1.0).or_null());
  v.add("gripper_command", "", "where it is commanded to be", t.gripper_command, within(0.0, 1.0).or_null());
  const int nodes = std::clamp(t.path_nodes, 0, static_cast<int>(t.path.size()));
  v.add("path", "m", "positions at the plan's nodes, in the base",
        std::span(t.path).first(static_cast<std::size_t>(nodes)) | std::views::transform(&Pose::p),
        sized(0, kMaxHorizon + 1));
  const auto expected = [&](int k) {
    const Vector3& p = t.prediction.p[k];
    const Spread& spread = t.prediction.spread[k];
    return std::array{p.x(), p.y(), p.z(), spread.along, spread.across};
  };
  v.add("prediction", "m",
        "where the hand is expected at the nodes of the horizon: x, y, z and standard deviations along and across its "
        "way (0: not known); none without a grip",
        std::views::iota(0, t.predicted) | std::views::transform(expected), sized(0, kMaxHorizon));
  v.group("liquid", "Liquid", "in the glass, simulated", [&](auto& inner) { describe_liquid(inner, t.liquid); });
}

/// Members of the message `state`, from a SessionSnapshot: the arm's motion.
template <typename V>
void describe_motion(V& v, SessionSnapshot& s) {
  v.add("q", "rad", "(m) measured", s.measured.q);
  v.add("dq", "rad/s", "(m/s) measured", s.measured.dq);
  v.add("command", "rad", "(m) commanded", s.command.q);
  v.add("tools", "", "those of `welcome.robot`, in that order",
        std::span(s.tools).first(static_cast<std::size_t>(s.tool_count)), sized(0, kMaxTools));
  v.add("clearance", "m", "distance of the nearest pair of bodies", s.clearance, kOrNull);
  v.add("nearest", "", "the nearest pair of bodies", s.nearest);
}

/// Members of `state`: counters and times.
template <typename V>
void describe_counts(V& v, SessionSnapshot& s) {
  v.add("solve_us", "us", "time of a planning step", s.solve_us);
  v.add("latency_us", "us", "from hand to command", s.latency_us);
  v.add("plans", "", "plans that were followed", s.plans);
  v.add("cycles", "", "control cycles", s.cycles);
  v.add("missed_deadlines", "", "control cycles that were missed", s.missed_deadlines);
  v.add("rejected_plans", "", "plans that were late, or failed their check", s.rejected_plans);
  v.add("samples", "", "samples of the hand", s.samples);
  v.add("planner_rate_hz", "Hz", "planning steps a second", s.planner_rate_hz);
  v.add("planner_rate_automatic", "", "it follows what the machine sustains", s.planner_rate_automatic);
}

template <typename V>
void describe(V& v, SessionSnapshot& s) {
  v.add("now_s", "s", "the session's clock", s.now);
  v.add("state", "", "what the arm may do; engaged: it follows a hand, of which `tools` has each", s.state);
  v.add("reason", "", "why, for people: its words may change", s.reason);
  v.add("reason_code", "", "the event that caused the state", s.cause.code);
  v.add("reason_leader", "", "whose hand was on the clutch then", s.cause.leader);
  v.add("constraint", "", "the limit that holds the arm back", s.constraint);
  describe_motion(v, s);
  describe_counts(v, s);
}

}  // namespace steadyhand
