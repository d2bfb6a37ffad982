#include "steadyhand/session/supervise/supervisor.hpp"

#include <algorithm>

namespace steadyhand {

namespace {

using State = SupervisionState;
using Event = SupervisionEvent;

// In each state the most severe event comes first.
constexpr Transition kTransitions[] = {
    {State::kIdle, Event::kArmStopped, State::kFault, ""},
    {State::kIdle, Event::kFailed, State::kFault, ""},
    {State::kIdle, Event::kStopAsked, State::kStopping, "a stop was asked for"},
    {State::kIdle, Event::kArmFollows, State::kReady, "engage to move the arm"},
    {State::kIdle, Event::kArmLate, State::kIdle, "the arm is still starting: it has not reported that it follows"},

    {State::kReady, Event::kArmStopped, State::kFault, ""},
    {State::kReady, Event::kFailed, State::kFault, ""},
    {State::kReady, Event::kStopAsked, State::kStopping, "a stop was asked for"},
    {State::kReady, Event::kStalled, State::kStopping, "the control loop stalled"},
    {State::kReady, Event::kOffPath, State::kStopping, "the arm is not at its commanded position"},
    {State::kReady, Event::kGripped, State::kEngaged, "the arm follows the hand"},

    {State::kEngaged, Event::kArmStopped, State::kFault, ""},
    {State::kEngaged, Event::kFailed, State::kFault, ""},
    {State::kEngaged, Event::kStopAsked, State::kStopping, "a stop was asked for"},
    {State::kEngaged, Event::kStalled, State::kStopping, "the control loop stalled"},
    {State::kEngaged, Event::kOffPath, State::kStopping, "the arm is not at its commanded position"},
    {State::kEngaged, Event::kSilence, State::kReady, "the device stopped sending: release and engage again"},
    {State::kEngaged, Event::kOtherSilent, State::kReady,
     "the other hand's device stopped sending: release and engage again"},
    {State::kEngaged, Event::kReleased, State::kReady, "released"},
    {State::kEngaged, Event::kGripped, State::kEngaged, "the arm is engaged"},  // the release was not seen
    {State::kEngaged, Event::kHandLost, State::kHolding, ""},
    {State::kEngaged, Event::kOtherLost, State::kHolding, "the other hand is lost"},
    {State::kEngaged, Event::kPlannerLate, State::kHolding, "the planner is late"},

    {State::kHolding, Event::kArmStopped, State::kFault, ""},
    {State::kHolding, Event::kFailed, State::kFault, ""},
    {State::kHolding, Event::kStopAsked, State::kStopping, "a stop was asked for"},
    {State::kHolding, Event::kStalled, State::kStopping, "the control loop stalled"},
    {State::kHolding, Event::kOffPath, State::kStopping, "the arm is not at its commanded position"},
    {State::kHolding, Event::kSilence, State::kReady, "the device stopped sending: release and engage again"},
    {State::kHolding, Event::kOtherSilent, State::kReady,
     "the other hand's device stopped sending: release and engage again"},
    {State::kHolding, Event::kReleased, State::kReady, "released"},
    {State::kHolding, Event::kHandBack, State::kEngaged, "the hand is back"},

    {State::kStopping, Event::kArmStopped, State::kFault, ""},
    {State::kStopping, Event::kFailed, State::kFault, ""},
    {State::kStopping, Event::kResetAsked, State::kIdle, "reset"},

    {State::kFault, Event::kResetAsked, State::kIdle, "reset"},
};

/// Code of an event in messages, and the reason if no person leads; empty: the row's reason.
struct EventTexts {
  Event event;
  ReasonCode code;
  std::string_view of_policy = {};
  std::string_view of_recording = {};  ///< a recording has nothing to release
};
constexpr EventTexts kEvents[] = {
    {Event::kArmStopped, ReasonCode::kArmStopped},
    {Event::kFailed, ReasonCode::kFailed},
    {Event::kArmFollows, ReasonCode::kReady},
    {Event::kArmLate, ReasonCode::kStarting},
    {Event::kStopAsked, ReasonCode::kStopAsked},
    {Event::kStalled, ReasonCode::kStalled},
    {Event::kOffPath, ReasonCode::kOffPath},
    {Event::kResetAsked, ReasonCode::kReset},
    {Event::kSilence, ReasonCode::kSilent, "the policy stopped sending: start its turn again",
     "the demo motion was delayed"},
    {Event::kReleased, ReasonCode::kReleased, "the policy's turn is over", "the demo motion ended"},
    {Event::kGripped, ReasonCode::kGripped, "the arm follows the policy", "the arm follows the demo motion"},
    {Event::kHandLost, ReasonCode::kHandLost},
    {Event::kHandBack, ReasonCode::kHandBack, "the policy's targets are back", "the demo motion continues"},
    {Event::kPlannerLate, ReasonCode::kPlannerLate},
    {Event::kOtherLost, ReasonCode::kOtherLost},
    {Event::kOtherSilent, ReasonCode::kOtherSilent, "another tool's targets are not received: start the turn again"},
};
static_assert(std::size(kEvents) == std::size_t{1} + static_cast<std::size_t>(Event::kOtherSilent));

const EventTexts& texts_of(Event event) {
  return *std::find_if(std::begin(kEvents), std::end(kEvents), [&](const EventTexts& e) { return e.event == event; });
}

ReasonCode code_of(Event event, const HandReport& hand) {
  if (event == Event::kReleased && hand.settings_wait) return ReasonCode::kProfileWaits;
  if (event == Event::kHandLost && hand.trusted) return ReasonCode::kNoPose;
  return texts_of(event).code;
}

}  // namespace

std::span<const Transition> transitions() { return kTransitions; }

bool Supervisor::happened(Event event, const SupervisionInput& input) const {
  const HandReport& hand = input.hand;
  const auto passed = [&](double seconds, Time since) { return to_seconds(input.now - since) > seconds; };
  const bool received = !passed(settings_.disengage_after, hand.received);
  const bool trusted = hand.trusted && !passed(settings_.hold_after, hand.good);
  switch (event) {
    case Event::kArmStopped:
      return input.arm_stopped;
    case Event::kFailed:
      return !input.failure.empty();
    case Event::kArmFollows:
      return input.arm_follows;
    case Event::kArmLate:
      return passed(settings_.arm_late_after, since_);
    case Event::kStopAsked:
      return input.stops != stops_;
    case Event::kStalled:
      return input.stalled;
    case Event::kOffPath:
      return input.off_path;
    case Event::kResetAsked:
      return input.reset_of == halts_ && input.stops == stops_ && input.at_rest;
    case Event::kSilence:
      return !received;
    case Event::kReleased:
      return !hand.clutch;
    case Event::kGripped:
      return received && trusted && hand.clutch && hand.grips != grips_used_;
    case Event::kHandLost:
      return !trusted;
    case Event::kHandBack:
      return received && trusted && hand.clutch && input.last_plan > since_ && !input.other_lost;
    case Event::kPlannerLate:
      return passed(settings_.planner_late_after, std::max(input.last_plan, since_));
    case Event::kOtherLost:
      return input.other_lost;
    case Event::kOtherSilent:
      return input.other_silent;
  }
  return false;
}

const Transition* Supervisor::update(const SupervisionInput& input) {
  if (since_ == Time(0)) since_ = input.now;
  const Transition* taken = step(input);
  const bool halts = taken != nullptr && (taken->to == State::kStopping || taken->to == State::kFault);
  if (halts || input.stops != stops_) ++halts_;
  stops_ = input.stops;
  return taken;
}

const Transition* Supervisor::step(const SupervisionInput& input) {
  for (const Transition& row : kTransitions) {
    if (row.from != state_ || !happened(row.event, input)) continue;
    state_ = row.to;
    since_ = input.now;
    reason_ = row.reason;
    cause_ = {code_of(row.event, input.hand), input.hand.leader};
    if (row.event == Event::kArmStopped) reason_ = input.arm_reason;
    if (row.event == Event::kFailed) reason_ = input.failure;
    if (row.event == Event::kHandLost) {
      reason_ = cause_.code == ReasonCode::kNoPose ? "no pose of the hand was received for a while"
                                                   : to_string(input.hand.verdict, input.hand.leader);
    }
    if (cause_.code == ReasonCode::kProfileWaits)
      reason_ = "the new profile starts after the arm has stopped: release and engage again";
    const EventTexts& texts = texts_of(row.event);
    const std::string_view reason = input.hand.leader == Leader::kPolicy      ? texts.of_policy
                                    : input.hand.leader == Leader::kRecording ? texts.of_recording
                                                                              : std::string_view();
    if (!reason.empty()) reason_ = reason;
    if (row.to == State::kEngaged) ++engagements_;
    // A grip that did not start following, or no longer follows, cannot be used again.
    grips_used_ = input.hand.grips;
    return &row;
  }
  return nullptr;
}

}  // namespace steadyhand
