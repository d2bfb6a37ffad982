#include "steadyhand/session/supervise/supervisor.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace steadyhand {
namespace {

using State = SupervisionState;
using Event = SupervisionEvent;

constexpr State kStates[] = {State::kIdle,    State::kReady,    State::kEngaged,
                             State::kHolding, State::kStopping, State::kFault};

/// A cycle in which all is well and the hand is open.
SupervisionInput calm(Time now) {
  SupervisionInput input;
  input.now = input.last_plan = input.hand.received = input.hand.good = now;
  input.arm_follows = input.at_rest = input.hand.trusted = true;
  return input;
}

/// Drives a supervisor to a state the way an operator would.
struct Driven {
  explicit Driven(State state) {
    step(calm(tick()));
    if (state == State::kIdle) {
      supervisor = Supervisor();
    } else if (state == State::kEngaged || state == State::kHolding) {
      step(gripped());
      if (state == State::kHolding) {
        SupervisionInput lost = gripped();
        lost.hand.trusted = false;
        step(lost);
      }
    } else if (state != State::kReady) {
      SupervisionInput input = calm(tick());
      input.arm_stopped = state == State::kFault;
      stops += state == State::kStopping;
      step(input);
    }
    EXPECT_EQ(supervisor.state(), state);
  }
  Time tick() { return now += std::chrono::milliseconds(2); }
  SupervisionInput gripped() {
    SupervisionInput input = calm(tick());
    input.hand.clutch = true;
    input.hand.grips = 1;
    return input;
  }
  State step(SupervisionInput input) {
    input.stops = stops;
    (void)supervisor.update(input);
    return supervisor.state();
  }

  Time now{std::chrono::seconds(5)};
  std::uint64_t stops = 0;
  Supervisor supervisor;
};

TEST(Supervisor, EveryRowIsTakenByItsEventAndSaysWhy) {
  std::set<std::string_view> codes;
  for (const Transition& row : transitions()) {
    Driven d(row.from);
    SupervisionInput input = row.from == State::kEngaged || row.from == State::kHolding ? d.gripped() : calm(d.tick());
    if (row.from == State::kHolding) input.hand.trusted = false;
    if (row.from == State::kIdle) input.arm_follows = false;
    ASSERT_EQ(d.step(input), row.from) << "nothing happened";
    input.now = d.tick();
    input.hand.received = input.hand.good = input.last_plan = input.now;
    switch (row.event) {
      case Event::kArmStopped:
        input.arm_stopped = true;
        input.arm_reason = "broken";
        break;
      case Event::kFailed:
        input.failure = "broken";
        break;
      case Event::kArmFollows:
        input.arm_follows = true;
        break;
      case Event::kArmLate:
        input.now += std::chrono::seconds(11);
        break;
      case Event::kStopAsked:
        ++d.stops;
        break;
      case Event::kStalled:
        input.stalled = true;
        break;
      case Event::kOffPath:
        input.off_path = true;
        break;
      case Event::kResetAsked:
        input.reset_of = d.supervisor.halts();
        break;
      case Event::kSilence:
        input.hand.received -= std::chrono::milliseconds(251);
        break;
      case Event::kReleased:
        input.hand.clutch = false;
        break;
      case Event::kGripped:
        input.hand.clutch = true;
        input.hand.grips = 7;
        break;
      case Event::kHandLost:
        input.hand.trusted = false;
        input.hand.verdict = HandVerdict::kJump;
        break;
      case Event::kHandBack:
        input.hand.trusted = true;
        break;
      case Event::kPlannerLate:
        input.now += std::chrono::milliseconds(300);
        input.hand.received = input.hand.good = input.now;
        break;
      case Event::kOtherLost:
        input.other_lost = true;
        break;
      case Event::kOtherSilent:
        input.other_silent = true;
        break;
    }
    EXPECT_EQ(d.step(input), row.to) << to_string(row.from) << " by event " << static_cast<int>(row.event);
    EXPECT_FALSE(d.supervisor.reason().empty());
    codes.insert(to_string(d.supervisor.cause().code));
  }
  EXPECT_EQ(codes.size(), 16u) << "each event has a code";
  EXPECT_EQ(codes.count("unknown"), 0u);
}

/// The page explains a device that stops sending, and a recording that is held up, in different words.
TEST(Supervisor, ItsCausesAreOfAHandAndAnEvent) {
  Driven d(State::kEngaged);
  EXPECT_EQ(d.supervisor.cause().code, ReasonCode::kGripped);
  SupervisionInput input = d.gripped();
  input.hand.good -= std::chrono::milliseconds(150);
  EXPECT_EQ(d.step(input), State::kHolding);
  EXPECT_EQ(to_string(d.supervisor.cause().code), "no_pose");
  input.hand.leader = Leader::kRecording;
  input.hand.received -= std::chrono::milliseconds(300);
  EXPECT_EQ(d.step(input), State::kReady);
  EXPECT_EQ(to_string(d.supervisor.cause().code), "silent");
  EXPECT_EQ(d.supervisor.cause().leader, Leader::kRecording);
  Driven other(State::kEngaged);
  input = other.gripped();
  input.hand.clutch = false;
  input.hand.settings_wait = true;
  EXPECT_EQ(other.step(input), State::kReady);
  EXPECT_EQ(to_string(other.supervisor.cause().code), "profile_waits");
  EXPECT_EQ(other.supervisor.reason(), "the new profile starts after the arm has stopped: release and engage again");
}

/// A recorded hand has no device that can time out, and no operator to release it.
TEST(Supervisor, SaysOfADemoMotionWhatIsTrueOfIt) {
  Driven d(State::kEngaged);
  SupervisionInput input = d.gripped();
  input.hand.leader = Leader::kRecording;
  input.hand.clutch = false;
  EXPECT_EQ(d.step(input), State::kReady);
  EXPECT_EQ(d.supervisor.reason(), "the demo motion ended");
  input = d.gripped();
  input.hand.leader = Leader::kRecording;
  input.hand.grips = 2;
  EXPECT_EQ(d.step(input), State::kEngaged);
  EXPECT_EQ(d.supervisor.reason(), "the arm follows the demo motion");
  input.hand.received -= std::chrono::milliseconds(300);
  EXPECT_EQ(d.step(input), State::kReady);
  EXPECT_EQ(d.supervisor.reason(), "the demo motion was delayed");
}

TEST(Supervisor, EveryStateCanStopAndCanBeLeftAndNoRowIsThereTwice) {
  std::set<std::pair<State, Event>> seen;
  std::set<State> left, faulted;
  for (const Transition& row : transitions()) {
    EXPECT_TRUE(seen.emplace(row.from, row.event).second);
    left.insert(row.from);
    if (row.event == Event::kArmStopped && row.to == State::kFault) faulted.insert(row.from);
    const bool moves = row.from == State::kIdle || row.from == State::kReady || row.from == State::kEngaged ||
                       row.from == State::kHolding;
    EXPECT_TRUE(!moves || seen.count({row.from, Event::kArmStopped}));  // the gravest first
    // Only a stop of another kind takes precedence over a requested stop.
    const bool grave = row.to == State::kFault || row.event == Event::kStopAsked;
    EXPECT_TRUE(!moves || grave || seen.count({row.from, Event::kStopAsked}));
  }
  for (const State state : kStates) {
    EXPECT_TRUE(left.count(state)) << to_string(state);
    EXPECT_EQ(faulted.count(state), state == State::kFault ? 0u : 1u) << to_string(state);
  }
}

TEST(Supervisor, OnlyAFreshGripEngages) {
  Driven d(State::kEngaged);
  SupervisionInput silent = d.gripped();
  silent.hand.received -= std::chrono::milliseconds(300);
  EXPECT_EQ(d.step(silent), State::kReady);
  EXPECT_EQ(d.step(d.gripped()), State::kReady) << "the old grip again";
  SupervisionInput fresh = d.gripped();
  fresh.hand.grips = 2;
  SupervisionInput old = fresh;  // fresh until the device stopped sending
  old.hand.received -= std::chrono::milliseconds(300);
  EXPECT_EQ(d.step(old), State::kReady);
  EXPECT_EQ(d.step(fresh), State::kEngaged);
  EXPECT_EQ(d.supervisor.engagements(), 2u);
}

TEST(Supervisor, AGripDuringAStopIsNotTakenUpAfterTheReset) {
  Driven d(State::kStopping);
  EXPECT_EQ(d.step(d.gripped()), State::kStopping);
  SupervisionInput reset = d.gripped();
  reset.reset_of = d.supervisor.halts();
  EXPECT_EQ(d.step(reset), State::kIdle);
  EXPECT_EQ(d.step(d.gripped()), State::kReady);
  EXPECT_EQ(d.step(d.gripped()), State::kReady);
}

TEST(Supervisor, AResetWaitsForRest) {
  for (const State state : {State::kStopping, State::kFault}) {
    Driven d(state);
    SupervisionInput input = calm(d.tick());
    input.reset_of = d.supervisor.halts();
    input.at_rest = false;
    EXPECT_EQ(d.step(input), state);
    input.at_rest = true;
    EXPECT_EQ(d.step(input), State::kIdle);
  }
}

/// For any inputs in any order: it never engages without a grip. A stop is obeyed in the cycle in which it arrives.
/// Only a reset that was asked for after that cycle undoes it, and only if nothing else has halted the arm since.
TEST(Supervisor, RandomInputs) {
  std::mt19937 random(4);
  std::bernoulli_distribution often(0.5), seldom(0.01);
  Supervisor supervisor;
  SupervisionInput input = calm(std::chrono::seconds(1));
  std::uint64_t grips_at_engagement = 0, undone = 0, beside = 0;
  int halted_in = -1, reset_in = -1;  // cycles: of what halted the arm last, of the newest reset
  for (int i = 0; i < 1000000; ++i) {
    input.now += std::chrono::milliseconds(2);
    if (!seldom(random)) input.hand.received = input.now - std::chrono::milliseconds(seldom(random) ? 400 : 0);
    input.hand.good = input.hand.received;
    input.last_plan = often(random) ? input.now : input.last_plan;
    if (seldom(random)) {
      input.hand.clutch = !input.hand.clutch;
      input.hand.grips += input.hand.clutch;
    }
    if (seldom(random)) input.hand.trusted = often(random);
    input.arm_stopped = seldom(random) && seldom(random);
    input.failure = seldom(random) && seldom(random) ? "broken" : "";
    input.off_path = seldom(random) && seldom(random);
    if (seldom(random)) input.at_rest = often(random);
    const State before = supervisor.state();
    const bool halted = before == State::kStopping || before == State::kFault;
    bool stop = seldom(random), reset = seldom(random);
    if (halted && seldom(random)) stop = reset = true;  // as operators do when an arm has stopped
    // Control may read the two in any order, and publishes its halts only after this cycle.
    if (reset) {
      input.reset_of = supervisor.halts();
      reset_in = i;
    }
    input.stops += stop ? 1 + often(random) : 0;
    const Transition* row = supervisor.update(input);
    const State after = supervisor.state();
    ASSERT_EQ(row != nullptr && row->to != row->from, before != after);
    if (after == State::kEngaged) {
      ASSERT_TRUE(input.hand.clutch && input.hand.trusted);
      if (before == State::kReady) {
        ASSERT_GT(input.hand.grips, grips_at_engagement);
        grips_at_engagement = input.hand.grips;
      }
    }
    if (stop) {
      ASSERT_TRUE(after == State::kStopping || after == State::kFault) << to_string(before);
      halted_in = i;
      beside += halted && reset;
    }
    const bool halts = after == State::kStopping || after == State::kFault;
    if (halts && after != before) halted_in = i;
    if (halted && !halts) {
      ASSERT_GT(reset_in, halted_in);
      ASSERT_TRUE(input.at_rest);
      ++undone;
    }
  }
  EXPECT_GT(supervisor.engagements(), 100u);
  EXPECT_GT(undone, 1000u);
  EXPECT_GT(beside, 1000u);
}

}  // namespace
}  // namespace steadyhand
