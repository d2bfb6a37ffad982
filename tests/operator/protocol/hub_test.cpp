#include "steadyhand/operator/protocol/hub.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>

#include "support/message_fuzz.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

struct FakeOutbox : Outbox {
  std::vector<Json> messages;
  int states = 0;
  bool closed = false;
  bool keep = true;
  bool this_user = false;
  void send(std::shared_ptr<const std::string> message) override {
    if (keep) messages.push_back(Json::parse(*message));
  }
  bool send_state(std::shared_ptr<const std::string>) override { return states++ > 0; }
  void close() override { closed = true; }
  bool of_this_user() override { return this_user; }

  const Json* last(const std::string& type) const {
    for (auto it = messages.rbegin(); it != messages.rend(); ++it) {
      if ((*it)["type"] == type) return &*it;
    }
    return nullptr;
  }
  std::string last_error() const {
    const Json* error = last("error");
    return error ? (*error)["code"].get<std::string>() : "";
  }
  std::string last_words() const {
    const Json* error = last("error");
    return error ? (*error)["message"].get<std::string>() : "";
  }
  int count(const std::string& type) const {
    return static_cast<int>(
        std::count_if(messages.begin(), messages.end(), [&](const Json& message) { return message["type"] == type; }));
  }
  bool has_lease() const {
    const Json* lease = last("lease");
    return lease && (*lease)["yours"].get<bool>();
  }
};

const Address kHere{"loopback", true};
constexpr int kPlaces = 40;

class HubTest : public testing::Test {
 protected:
  HubTest() {
    facts_.robot = "{}";
    facts_.profiles = {{"tracking", "Tracking", {0.0}}};
    facts_.recordings = {"reach"};
    facts_.terms = {{"lateral", "Liquid", "1"}};
    callbacks_.now = [this] { return now_; };
    callbacks_.on_sample = [this](const OperatorSample& sample) { samples_.push_back(sample); };
    callbacks_.on_request = [this](const OperatorRequest& request) {
      requests_.push_back(request);
      return answer_;
    };
    callbacks_.on_lease = [this](std::uint64_t client) { leases_.push_back(client); };
    callbacks_.on_pairing = [this](const auto&) { ++codes_shown_; };
    EXPECT_TRUE(hub_.prepare());
  }

  std::uint64_t greet(FakeOutbox& outbox, const std::string& token = "", const Address& address = kHere) {
    const auto id = hub_.join(outbox, address, now_);
    Json hello = {{"type", "hello"}, {"version", kProtocolVersion}};
    if (!token.empty()) hello["token"] = token;
    say(id, hello);
    return id;
  }
  std::uint64_t pair(FakeOutbox& outbox) {
    const auto id = greet(outbox);
    say(id, {{"type", "pair"}, {"code", hub_.code()}});
    return id;
  }
  void say(std::uint64_t id, const Json& message) { hub_.receive(id, message.dump(), now_); }
  static Json sample(std::uint64_t sequence, double t) {
    return {{"type", "sample"},  {"sequence", sequence}, {"t_s", t},        {"p", {0, 0, 1}},
            {"q", {0, 0, 0, 1}}, {"clutch", true},       {"tracked", true}, {"emulated", false}};
  }

  Time now_ = std::chrono::seconds(100);
  ServerFacts facts_;
  ServerCallbacks callbacks_;
  Hub hub_{facts_, callbacks_, 250.0, kPlaces};
  std::vector<OperatorSample> samples_;
  std::vector<OperatorRequest> requests_;
  Status answer_ = Done{};  ///< to the requests
  std::vector<std::uint64_t> leases_;
  int codes_shown_ = 0;
};

TEST_F(HubTest, RefusesAnotherVersionAndWhoDoesNotGreet) {
  FakeOutbox future, rude;
  say(hub_.join(future, kHere, now_), {{"type", "hello"}, {"version", kProtocolVersion + 1}, {"new", "thing"}});
  EXPECT_EQ(future.last_error(), "version");
  EXPECT_TRUE(future.closed);
  say(hub_.join(rude, kHere, now_), {{"type", "take"}});
  EXPECT_TRUE(rude.closed);
  EXPECT_TRUE(leases_.empty());
}

TEST_F(HubTest, ACodePairsUntilOneOfItsClientsCommands) {
  FakeOutbox phone, headset, late;
  const std::string code = hub_.code();
  pair(phone);  // another client opens the link
  const auto id = pair(headset);
  ASSERT_TRUE(phone.last("paired"));
  ASSERT_TRUE(headset.last("paired"));
  EXPECT_NE((*phone.last("paired"))["token"], (*headset.last("paired"))["token"]);
  EXPECT_EQ(hub_.code(), code);
  EXPECT_EQ(codes_shown_, 0);
  say(id, {{"type", "take"}});
  EXPECT_NE(hub_.code(), code);
  EXPECT_EQ(codes_shown_, 1);
  const auto third = greet(late);
  say(third, {{"type", "pair"}, {"code", code}});
  EXPECT_EQ(late.last_error(), "code");
  EXPECT_NE(late.last_words().find("used up"), std::string::npos) << late.last_words();
  // A client that takes control again, or that paired with an older code, uses up no code.
  const std::string next = hub_.code();
  say(id, {{"type", "release"}});
  say(id, {{"type", "take"}});
  EXPECT_EQ(hub_.code(), next);
}

TEST_F(HubTest, ACodeIsEasyToTypeAndARefusalSaysWhatIsWrong) {
  FakeOutbox a, b;
  const std::string code = hub_.code();
  EXPECT_EQ(code.find_first_not_of("bcdfghjkmnpqrstvwxyz"), std::string::npos) << code;
  EXPECT_GE(std::log2(20.0) * static_cast<double>(code.size()), 50.0);
  const auto id = greet(a);
  say(id, {{"type", "pair"}, {"code", code.substr(1)}});
  EXPECT_NE(a.last_words().find("12 letters, this one 11"), std::string::npos) << a.last_words();
  std::string wrong = code;
  wrong.back() = wrong.back() == 'b' ? 'c' : 'b';
  say(id, {{"type", "pair"}, {"code", wrong}});
  EXPECT_NE(a.last_words().find("wrong"), std::string::npos) << a.last_words();
  std::string typed = " " + code.substr(0, 4) + "-" + code.substr(4, 4) + " " + code.substr(8);
  typed[1] = static_cast<char>(std::toupper(typed[1]));
  say(id, {{"type", "pair"}, {"code", typed}});
  EXPECT_TRUE(a.last("paired"));
  // Paired already: the same token, for any code.
  const Json token = (*a.last("paired"))["token"];
  say(id, {{"type", "pair"}, {"code", "wrong"}});
  EXPECT_EQ((*a.last("paired"))["token"], token);
}

TEST_F(HubTest, AProgramOfTheSameUserNeedsNoCodeAndUsesUpNone) {
  FakeOutbox own, strange;
  own.this_user = true;
  const std::string code = hub_.code();
  const auto id = greet(own), stranger = greet(strange);
  EXPECT_FALSE(own.last("paired")) << "it has to ask for it";
  for (const auto each : {id, stranger}) say(each, {{"type", "pair"}, {"code", "local"}});
  EXPECT_TRUE(own.last("paired"));
  EXPECT_EQ(strange.last_error(), "code");
  say(id, {{"type", "take"}});
  EXPECT_EQ(hub_.holder(), id);
  EXPECT_EQ(hub_.code(), code);
}

TEST_F(HubTest, WrongCodesDelayTheirConnectionAndLockNobodyOut) {
  FakeOutbox guesser, operator_;
  const auto id = greet(guesser);
  for (int i = 0; i < Hub::kFreeCodes; ++i) say(id, {{"type", "pair"}, {"code", "wrong"}});
  const auto answers = [&] { return guesser.count("error") + guesser.count("paired"); };
  EXPECT_EQ(answers(), Hub::kFreeCodes);
  pair(operator_);
  EXPECT_TRUE(operator_.last("paired")) << "another connection is not affected";
  say(id, {{"type", "pair"}, {"code", "wrong"}});
  say(id, {{"type", "pair"}, {"code", hub_.code()}});
  hub_.tick(now_ += Hub::kCodeDelay - Time(1));
  EXPECT_EQ(answers(), Hub::kFreeCodes);
  hub_.tick(now_ += Time(1));
  EXPECT_TRUE(guesser.last("paired")) << "late, but not refused";
  EXPECT_EQ(answers(), Hub::kFreeCodes + 1) << "one answer for what came meanwhile";
}

TEST_F(HubTest, MovesNothingForAClientWithoutTheLease) {
  FakeOutbox watcher, paired;
  const auto watching = greet(watcher);
  say(watching, {{"type", "take"}});
  EXPECT_EQ(watcher.last_error(), "unpaired");
  say(watching, sample(1, 5.0));
  const auto id = pair(paired);
  say(id, sample(1, 5.0));
  EXPECT_EQ(paired.last_error(), "no_lease");
  for (const char* kind : {"reset", "profile", "scale"}) {
    Json request = {{"type", "request"}, {"kind", kind}};
    if (kind == std::string("profile")) request["text"] = "tracking";
    if (kind == std::string("scale")) request["value"] = 1.0;
    say(watching, request);
    EXPECT_EQ(watcher.last_error(), "no_lease");
  }
  EXPECT_TRUE(samples_.empty());
  EXPECT_TRUE(requests_.empty());
}

TEST_F(HubTest, AnyClientStops) {
  FakeOutbox watcher;
  say(greet(watcher), {{"type", "request"}, {"kind", "stop"}});
  ASSERT_EQ(requests_.size(), 1u);
  EXPECT_EQ(requests_[0].kind, OperatorRequest::Kind::kStop);
}

/// Also of a client that is being sent away, until its socket is closed.
TEST_F(HubTest, AStopCountsWhateverIsWrongWithItsClient) {
  const Json stop{{"type", "request"}, {"kind", "stop"}};
  FakeOutbox newer, garbled, rude, flooder;
  const auto of_another_version = hub_.join(newer, kHere, now_);
  say(of_another_version, {{"type", "hello"}, {"version", kProtocolVersion + 1}});
  ASSERT_TRUE(newer.closed);
  say(of_another_version, stop);
  EXPECT_EQ(requests_.size(), 1u) << "behind a hello of another version";

  const auto bad = greet(garbled);
  for (int i = 0; i <= Hub::kMaxStrikes; ++i) hub_.receive(bad, "{", now_);
  ASSERT_TRUE(garbled.closed);
  say(bad, stop);
  EXPECT_EQ(requests_.size(), 2u) << "behind malformed messages";

  const auto silent = hub_.join(rude, kHere, now_);
  say(silent, {{"type", "take"}});
  ASSERT_TRUE(rude.closed);
  say(silent, stop);
  EXPECT_EQ(requests_.size(), 3u) << "of a client that never greeted";

  const auto many = greet(flooder);
  for (int i = 0; i < 4000; ++i) say(many, {{"type", "release"}});
  ASSERT_TRUE(flooder.closed);
  say(many, stop);
  EXPECT_EQ(requests_.size(), 4u) << "behind a flood";
  for (const OperatorRequest& request : requests_) EXPECT_EQ(request.kind, OperatorRequest::Kind::kStop);
  say(many, {{"type", "request"}, {"kind", "reset"}});
  EXPECT_EQ(requests_.size(), 4u) << "nothing else does";
}

TEST_F(HubTest, AStopCountsWhateverElseStandsInItsMessage) {
  FakeOutbox watcher;
  const auto id = greet(watcher);
  for (const char* text : {R"({"type":"request","kind":"stop","reason":"hand"})",
                           R"({"type":"request","kind":"stop","text":7,"value":"now","to":null,"object":[]})",
                           R"({"why":{"deep":[1]},"kind":"stop","type":"request"})"}) {
    const std::size_t before = requests_.size();
    hub_.receive(id, text, now_);
    EXPECT_EQ(requests_.size(), before + 1) << text;
  }
  EXPECT_FALSE(watcher.closed);
}

TEST_F(HubTest, EverybodyIsToldWhoStopsButNotOfEachStopOfAFlood) {
  FakeOutbox driver, watcher;
  pair(driver);
  const auto stopper = greet(watcher);
  const Json stop{{"type", "request"}, {"kind", "stop"}};
  for (int i = 0; i < 1000; ++i) say(stopper, stop);
  EXPECT_EQ(requests_.size(), 1000u);
  ASSERT_NE(driver.last("stopped"), nullptr);
  EXPECT_EQ((*driver.last("stopped"))["client"], stopper);
  EXPECT_LT(driver.messages.size(), 20u);
}

TEST_F(HubTest, TwoClientsFightForTheLease) {
  FakeOutbox a, b;
  const auto first = pair(a), second = pair(b);
  say(first, {{"type", "take"}});
  for (int i = 0; i < 20; ++i) say(second, {{"type", "take"}});
  EXPECT_TRUE(a.has_lease());
  EXPECT_FALSE(b.has_lease());
  EXPECT_EQ(b.last_error(), "taken");
  say(second, {{"type", "release"}});  // not its to give
  EXPECT_EQ(leases_, std::vector<std::uint64_t>({first}));
  say(first, {{"type", "release"}});
  say(second, {{"type", "take"}});
  EXPECT_EQ(leases_, std::vector<std::uint64_t>({first, 0, second}));
  hub_.leave(second, now_);
  EXPECT_EQ(leases_.back(), 0u);
}

TEST_F(HubTest, LeaseEndsInSilenceAndComesBackWithTheToken) {
  FakeOutbox a, again;
  const auto id = pair(a);
  say(id, {{"type", "take"}});
  const std::string token = (*a.last("paired"))["token"];
  now_ += Hub::kLeaseSilence / 2;
  say(id, {{"type", "ping"}, {"t_s", 1.0}});
  now_ += Hub::kLeaseSilence;
  hub_.tick(now_);
  EXPECT_EQ(hub_.holder(), id);
  now_ += Time(1);
  hub_.tick(now_);
  EXPECT_EQ(hub_.holder(), 0u);
  // A new connection of the same client takes it from its own dead one without waiting.
  say(id, {{"type", "take"}});
  const auto back = greet(again, token);
  say(back, {{"type", "take"}});
  EXPECT_EQ(hub_.holder(), back);
  EXPECT_FALSE(a.has_lease());
}

/// Two people, each paired; the first holds the lease.
class AskingTest : public HubTest {
 protected:
  AskingTest() : holder_(pair(holds_)), asker_(pair(asks_)) { say(holder_, {{"type", "take"}}); }

  /// Lets time pass; both are heard now and then.
  void wait(Time span, bool closed_clutch = false) {
    for (const Time end = now_ + span; now_ < end;) {
      now_ += std::chrono::milliseconds(100);
      say(holder_, {{"type", "ping"}, {"t_s", to_seconds(now_)}});
      say(asker_, {{"type", "ping"}, {"t_s", to_seconds(now_)}});
      if (closed_clutch) say(holder_, sample(++sequence_, to_seconds(now_)));
      hub_.tick(now_);
    }
  }
  const Json& lease(const FakeOutbox& outbox) const { return *outbox.last("lease"); }

  FakeOutbox holds_, asks_;
  std::uint64_t holder_, asker_, sequence_ = 0;
};

TEST_F(AskingTest, TheHolderSeesWhoAsksAndGrants) {
  EXPECT_FALSE(lease(asks_)["takeable"]);
  say(asker_, {{"type", "take"}});
  EXPECT_EQ(asks_.last_error(), "taken");
  EXPECT_EQ(lease(holds_)["asker"], 0) << "taking is not asking";
  say(asker_, {{"type", "ask"}});
  for (const FakeOutbox* each : {&holds_, &asks_}) {
    EXPECT_EQ(lease(*each)["asker"], asker_);
    EXPECT_EQ(lease(*each)["grant_s"], 10.0);
  }
  EXPECT_EQ(hub_.holder(), holder_);
  say(asker_, {{"type", "answer"}, {"grant", true}});
  EXPECT_EQ(hub_.holder(), holder_) << "nobody grants it to himself";
  say(holder_, {{"type", "answer"}, {"grant", true}});
  EXPECT_EQ(hub_.holder(), asker_);
  EXPECT_EQ(leases_, std::vector<std::uint64_t>({holder_, asker_}));
  EXPECT_TRUE(asks_.has_lease());
  EXPECT_EQ(lease(asks_)["asker"], 0);
}

TEST_F(AskingTest, AHolderThatRefusesIsNotAskedAgainAtOnce) {
  say(asker_, {{"type", "ask"}});
  say(holder_, {{"type", "answer"}, {"grant", false}});
  EXPECT_EQ(asks_.last_error(), "taken");
  EXPECT_EQ(lease(holds_)["asker"], 0);
  wait(Hub::kAskTimeout - std::chrono::seconds(1));
  say(asker_, {{"type", "ask"}});
  EXPECT_EQ(lease(holds_)["asker"], 0);
  wait(std::chrono::seconds(1));
  say(asker_, {{"type", "ask"}});
  EXPECT_EQ(lease(holds_)["asker"], asker_);
}

TEST_F(AskingTest, ASilentHolderLosesTheLeaseAfterTenSecondsAtRest) {
  say(asker_, {{"type", "ask"}});
  wait(Hub::kAskTimeout - std::chrono::milliseconds(100));
  EXPECT_EQ(hub_.holder(), holder_);
  wait(std::chrono::milliseconds(100));
  EXPECT_EQ(hub_.holder(), asker_);
}

TEST_F(AskingTest, AHandThatLeadsTheArmIsNotTakenAway) {
  wait(std::chrono::milliseconds(100), true);
  say(asker_, {{"type", "ask"}});
  EXPECT_TRUE(lease(asks_)["grant_s"].is_null());
  wait(3 * Hub::kAskTimeout, true);
  EXPECT_EQ(hub_.holder(), holder_);
  wait(Hub::kAskTimeout);  // the clutch closed for the last time a quarter of a second before it counts as open
  EXPECT_EQ(hub_.holder(), holder_);
  EXPECT_LT(lease(asks_)["grant_s"], 10.1);
  wait(Hub::kOldest + std::chrono::milliseconds(100));
  EXPECT_EQ(hub_.holder(), asker_);
}

TEST_F(AskingTest, NeitherIsARecordingThatLeadsIt) {
  OperatorView snapshot;
  snapshot.state = SupervisionState::kEngaged;
  hub_.broadcast_state(snapshot);
  say(asker_, {{"type", "ask"}});
  wait(3 * Hub::kAskTimeout);
  EXPECT_EQ(hub_.holder(), holder_);
  snapshot.state = SupervisionState::kStopping;
  hub_.broadcast_state(snapshot);
  wait(Hub::kAskTimeout + std::chrono::milliseconds(100));
  EXPECT_EQ(hub_.holder(), asker_);
}

TEST_F(AskingTest, WhoAskedGetsWhatTheHolderLeavesAndMayThinkBetterOfIt) {
  say(asker_, {{"type", "ask"}});
  say(asker_, {{"type", "release"}});
  EXPECT_EQ(lease(holds_)["asker"], 0);
  wait(2 * Hub::kAskTimeout);
  EXPECT_EQ(hub_.holder(), holder_);
  say(asker_, {{"type", "ask"}});
  hub_.leave(holder_, now_);
  EXPECT_EQ(hub_.holder(), asker_);
}

TEST_F(AskingTest, WhoAsksAndFallsSilentIsForgotten) {
  say(asker_, {{"type", "ask"}});
  now_ += Hub::kLeaseSilence + Time(1);
  say(holder_, {{"type", "ping"}, {"t_s", 1.0}});
  hub_.tick(now_);
  EXPECT_EQ(lease(holds_)["asker"], 0);
  EXPECT_EQ(hub_.holder(), holder_);
}

TEST_F(AskingTest, OneAsksAtATimeAndNobodyUnpaired) {
  FakeOutbox stranger, third;
  say(greet(stranger), {{"type", "ask"}});
  EXPECT_EQ(stranger.last_error(), "unpaired");
  say(asker_, {{"type", "ask"}});
  const auto other = pair(third);
  say(other, {{"type", "ask"}});
  EXPECT_EQ(third.last_error(), "taken");
  EXPECT_EQ(lease(third)["asker"], asker_);
  hub_.leave(asker_, now_);
  EXPECT_EQ(lease(third)["asker"], 0);
  say(other, {{"type", "ask"}});
  EXPECT_EQ(lease(third)["asker"], other);
}

TEST_F(AskingTest, ThePersonsOtherTabTakesItWithoutAsking) {
  FakeOutbox tab;
  const auto id = greet(tab, (*holds_.last("paired"))["token"]);
  EXPECT_TRUE(lease(tab)["takeable"]);
  say(id, {{"type", "take"}});
  EXPECT_EQ(hub_.holder(), id);
  EXPECT_FALSE(holds_.has_lease());
}

/// A release may overtake samples with a closed clutch; these must not close the clutch again.
TEST_F(HubTest, WhatAReleaseOvertookStaysDropped) {
  FakeOutbox outbox;
  const auto id = pair(outbox);
  say(id, {{"type", "take"}});
  say(id, sample(10, 50.0));
  ASSERT_EQ(samples_.size(), 1u);
  Json release = sample(5, 50.0);
  release["clutch"] = false;
  say(id, release);
  ASSERT_EQ(samples_.size(), 2u);
  EXPECT_FALSE(samples_.back().clutch);
  now_ += std::chrono::milliseconds(10);
  for (const std::uint64_t sequence : {6, 9, 10}) say(id, sample(sequence, 50.01));
  EXPECT_EQ(samples_.size(), 2u);
  say(id, sample(11, 50.01));
  EXPECT_EQ(samples_.size(), 3u);
}

/// Bursts within what the pauses between them allow are no flood, however long they go on.
TEST_F(HubTest, BurstsWithPausesAreNoFlood) {
  FakeOutbox outbox;
  const auto id = pair(outbox);
  for (int burst = 0; burst < 40; ++burst) {
    now_ += std::chrono::seconds(2);
    for (int i = 0; i < 400; ++i) say(id, {{"type", "ping"}, {"t_s", 0.0}});
  }
  EXPECT_FALSE(outbox.closed);
}

TEST_F(HubTest, AReleaseIsNeverDropped) {
  FakeOutbox a;
  const auto id = pair(a);
  say(id, {{"type", "take"}});
  for (int i = 1; i <= 50; ++i) {
    now_ += from_seconds(0.02);
    say(id, sample(static_cast<std::uint64_t>(i), 0.02 * i));
  }
  const auto release = [&](std::uint64_t sequence, double t) {
    Json message = sample(sequence, t);
    message["clutch"] = false;
    const std::size_t before = samples_.size();
    say(id, message);
    ASSERT_EQ(samples_.size(), before + 1) << message;
    EXPECT_FALSE(samples_.back().clutch);
    // For any claimed time, the gate must find the sample newer than the previous ones, and fresh.
    EXPECT_GE(samples_.back().stamp.hand, samples_[before - 1].stamp.hand);
    EXPECT_LE(now_ - samples_.back().stamp.hand, Hub::kOldest / 2);
  };
  release(49, 0.98);  // out of order
  now_ += from_seconds(0.01);
  release(50, 1.0);  // twice
  now_ += from_seconds(0.01);
  release(51, -5.0);           // its clock stepped back
  now_ += from_seconds(0.35);  // the network stalled
  release(52, 1.04);
  now_ += from_seconds(0.2);
  release(53, 1.37);  // by 200 ms only
}

TEST_F(HubTest, TellsAClientWhoseSamplesAreOfAnotherClock) {
  FakeOutbox a;
  const auto id = pair(a);
  say(id, {{"type", "take"}});
  for (int i = 1; i <= 200; ++i) {
    now_ += from_seconds(0.01);
    if (i % 50 == 1) say(id, {{"type", "ping"}, {"t_s", 1.7e6 + 0.01 * i}});
    say(id, sample(static_cast<std::uint64_t>(i), 5.0 + 0.01 * i));
  }
  EXPECT_TRUE(samples_.empty());
  EXPECT_EQ(a.last_error(), "late");
  EXPECT_GE(a.count("error"), 2) << "once a second";
  EXPECT_LE(a.count("error"), 3);
}

/// A client in control of a robot with two tools; its clock is the session's, 5 s behind.
struct TwoHands : HubTest {
  TwoHands() : id(pair(client)) {
    facts_.tools = 2;
    say(id, {{"type", "take"}});
  }
  /// @param late s from when the hand was there to when the sample arrives
  void send(int tool, std::uint64_t sequence, bool clutch = true, double late = 0.0) {
    Json message = sample(sequence, to_seconds(now_) - 5.0 - late);
    message["tool"] = tool;
    message["clutch"] = clutch;
    say(id, message);
  }
  std::vector<std::uint64_t> count() const {
    std::vector<std::uint64_t> each(2);
    for (const OperatorSample& one : samples_) ++each[one.tool];
    return each;
  }

  FakeOutbox client;
  std::uint64_t id;
};
using Counts = std::vector<std::uint64_t>;

TEST_F(TwoHands, HaveAnOrderEach) {
  send(0, 50);
  send(1, 1);
  EXPECT_EQ(count(), (Counts{1, 1}));
  now_ += from_seconds(0.01);
  send(0, 50);
  send(1, 1);
  EXPECT_EQ(count(), (Counts{1, 1})) << "duplicates";
  send(0, 51);
  send(1, 2, true, 0.005);
  EXPECT_EQ(count(), (Counts{2, 2})) << "one hand was seen earlier than the other";
  send(0, 52, true, 0.004);
  EXPECT_EQ(count(), (Counts{2, 2})) << "but a hand does not go back in time";
}

TEST_F(TwoHands, OneReleasesLateAndTheOtherGoesOn) {
  for (std::uint64_t i = 1; i <= 100; ++i) {
    now_ += from_seconds(0.01);
    send(0, i);
    send(1, i);
  }
  now_ += from_seconds(0.01);
  send(1, 3, false, 0.9);
  ASSERT_EQ(samples_.back().tool, 1);
  EXPECT_FALSE(samples_.back().clutch);
  EXPECT_EQ(samples_.back().stamp.hand, now_) << "it counts from its arrival";
  send(0, 101, true, 0.005);
  EXPECT_EQ(samples_.back().tool, 0);
  EXPECT_TRUE(samples_.back().clutch);
  EXPECT_EQ(count(), (Counts{101, 101}));
  send(1, 101, true, 0.005);
  EXPECT_EQ(count(), (Counts{101, 101})) << "it was closed before that release";
}

/// As messages that are none, which are counted; a tool that only this robot lacks is no mistake of the message.
TEST_F(TwoHands, ToolsThatThereAreNotAreRefused) {
  const double now = to_seconds(now_);
  for (const Json& tool : {Json(-1), Json(2), Json(1.5), Json("left"), Json(1e300), Json(nullptr)}) {
    Json message = sample(1, now);
    message["tool"] = tool;
    say(id, message);
    EXPECT_EQ(client.last_error(), "malformed") << tool;
  }
  facts_.tools = 1;
  for (std::uint64_t i = 0; i < 2 * Hub::kMaxStrikes; ++i) {
    now_ += from_seconds(0.1);
    send(1, i, i % 2 == 0);
  }
  EXPECT_EQ(client.last_error(), "unknown");
  EXPECT_EQ(client.last_words(), "'tool' is 1; the tools of this robot are 0 to 0");
  say(id, {{"type", "request"}, {"kind", "attach"}, {"text", "bottle"}, {"tool", 1}});
  EXPECT_TRUE(requests_.empty());
  EXPECT_TRUE(samples_.empty());
  EXPECT_FALSE(client.closed);
  send(0, 1);
  EXPECT_EQ(samples_.size(), 1u);
}

TEST_F(TwoHands, APolicySendsTargetsOfEachTool) {
  std::vector<int> tools;
  callbacks_.on_policy = [](const std::optional<PolicyInfo>&) { return Status(Done{}); };
  callbacks_.on_target = [&](const PolicyTarget& target) { tools.push_back(target.tool); };
  say(id, {{"type", "policy"}, {"name", "test"}, {"period_s", 0.05}});
  const auto aim = [&](const Json& tool) {
    Json message{{"type", "target"}, {"of_s", to_seconds(now_)}, {"p", {0, 0, 1}}, {"q", {0, 0, 0, 1}}};
    if (!tool.is_null()) message["tool"] = tool;
    say(id, message);
  };
  for (const Json& tool : {Json(), Json(1), Json(0)}) aim(tool);
  EXPECT_EQ(tools, (std::vector{0, 1, 0}));
  facts_.tools = 1;
  aim(1);
  EXPECT_EQ(tools.size(), 3u);
  EXPECT_EQ(client.last_error(), "unknown");
}

TEST_F(HubTest, AClockThatWasSetBackIsUnderstoodAgain) {
  FakeOutbox a;
  const auto id = pair(a);
  say(id, {{"type", "take"}});
  double t = 1000.0;
  std::uint64_t sequence = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i == 100) t -= 60.0;
    now_ += from_seconds(0.01);
    say(id, sample(++sequence, t += 0.01));
    if (i == 110) {
      EXPECT_EQ(samples_.size(), 100u);
    }
  }
  EXPECT_GT(samples_.size(), 100u + 800u) << "within two windows of its clock";
  EXPECT_LE(now_ - samples_.back().stamp.hand, Hub::kOldest);
}

TEST_F(HubTest, DropsWhatIsOldDuplicatedOrOutOfOrder) {
  FakeOutbox a;
  const auto id = pair(a);
  say(id, {{"type", "take"}});
  // 90 Hz for a second, as it should be; the client's clock is ahead of the session's by 900 s.
  double t = 1000.0;
  std::uint64_t sequence = 0;
  for (int i = 0; i < 90; ++i) {
    now_ += from_seconds(1.0 / 90);
    t += 1.0 / 90;
    say(id, sample(++sequence, t));
  }
  EXPECT_EQ(samples_.size(), 90u);
  say(id, sample(sequence, t));            // duplicate
  say(id, sample(sequence - 1, t));        // reordered
  say(id, sample(sequence + 1, t - 1.0));  // its clock steps back
  EXPECT_EQ(samples_.size(), 90u);
  // 400 ms of them come at once after a stall: only those of the last 250 ms are news.
  const Time stall = std::chrono::milliseconds(400);
  const Time arrival = now_ + stall;
  const Time before = now_;
  now_ = arrival;
  for (int i = 1; i <= 40; ++i) say(id, sample(++sequence, t + 0.01 * i));
  EXPECT_EQ(samples_.size(), 90u + 26u);
  EXPECT_EQ(samples_.back().stamp.hand, samples_.back().stamp.made);
  for (std::size_t i = 90; i < samples_.size(); ++i) {
    EXPECT_LE(arrival - samples_[i].stamp.hand, Hub::kOldest);
    EXPECT_GT(samples_[i].stamp.hand, before);
    EXPECT_EQ(samples_[i].stamp.made, arrival);
  }
}

TEST_F(HubTest, DiscardsAFloodButNotItsStop) {
  FakeOutbox a;
  const auto id = pair(a);
  say(id, {{"type", "take"}});
  for (int i = 1; i <= 2000; ++i) say(id, sample(static_cast<std::uint64_t>(i), 5.0));
  EXPECT_LE(samples_.size(), 250u);
  EXPECT_FALSE(a.closed);
  say(id, {{"type", "request"}, {"kind", "stop"}});
  EXPECT_EQ(requests_.size(), 1u);
  for (int i = 1; i <= 2000; ++i) say(id, sample(static_cast<std::uint64_t>(i), 5.0));
  EXPECT_TRUE(a.closed);
  EXPECT_LT(a.messages.size(), 20u) << "a flood must not be answered with one";
}

TEST_F(HubTest, ChecksNamesAndScale) {
  FakeOutbox a;
  const auto id = pair(a);
  say(id, {{"type", "take"}});
  say(id, {{"type", "request"}, {"kind", "profile"}, {"text", "traking"}});
  EXPECT_EQ(a.last_error(), "unknown");
  say(id, {{"type", "request"}, {"kind", "playback"}, {"text", "nothing"}});
  say(id, {{"type", "request"}, {"kind", "scale"}, {"value", 0.0}});
  say(id, {{"type", "request"}, {"kind", "weight"}, {"text", "sideways"}, {"value", 1.0}});
  EXPECT_TRUE(requests_.empty());
  say(id, {{"type", "request"}, {"kind", "playback"}, {"text", "reach"}});
  say(id, {{"type", "request"}, {"kind", "profile"}, {"text", "tracking"}});
  EXPECT_EQ(requests_.size(), 2u);
}

TEST_F(HubTest, WhatTheSessionCannotDoIsToldToWhoAskedForIt) {
  FakeOutbox a;
  const auto id = pair(a);
  say(id, {{"type", "take"}});
  answer_ = Error{"65 objects; there may be at most 64"};
  say(id, {{"type", "request"}, {"kind", "object"}, {"text", "box"}, {"object", nullptr}});
  ASSERT_EQ(requests_.size(), 1u);
  EXPECT_EQ(a.last_error(), "unknown");
  EXPECT_EQ(a.last_words(), "65 objects; there may be at most 64");
  const std::size_t told = a.messages.size();
  for (int i = 0; i < 50; ++i) say(id, {{"type", "request"}, {"kind", "reset"}});
  EXPECT_EQ(a.messages.size(), told) << "once a second";
}

/// Mutated good messages and noise from clients that may not command, 100,000 of them: none moves anything.
TEST_F(HubTest, FuzzNeverCommands) {
  MessageFuzz fuzz(20240601);
  FakeOutbox outbox;
  outbox.keep = false;
  std::uint64_t id = 0;
  for (int i = 0; i < 100'000; ++i) {
    if (i % 16 == 0) {  // a client is closed after a few
      hub_.leave(id, now_);
      outbox.closed = false;
      id = greet(outbox);
    }
    now_ += from_seconds(0.005);
    hub_.receive(id, fuzz.next(), now_);
  }
  EXPECT_TRUE(samples_.empty());
  EXPECT_TRUE(leases_.empty());
  EXPECT_FALSE(requests_.empty());
  for (const OperatorRequest& request : requests_) EXPECT_EQ(request.kind, OperatorRequest::Kind::kStop);
  EXPECT_GT(hub_.refused_messages, 10'000u);
}

class PlacesTest : public HubTest {
 protected:
  /// Fills the places that are left from one address; greeted clients that then only ping.
  void crowd(const Address& address) {
    while (hub_.clients() < kPlaces) come(address);
  }
  FakeOutbox& come(const Address& address) {
    outboxes_.push_back(std::make_unique<FakeOutbox>());
    last_ = greet(*outboxes_.back(), "", address);
    return *outboxes_.back();
  }
  std::vector<std::unique_ptr<FakeOutbox>> outboxes_;
  std::uint64_t last_ = 0;
};

TEST_F(PlacesTest, WhoSaysNothingUsefulLeavesFirst) {
  FakeOutbox paired, stops;
  pair(paired);
  const auto stopper = greet(stops);
  FakeOutbox& first = come(kHere);
  crowd(kHere);
  now_ += std::chrono::seconds(1);
  say(stopper, {{"type", "request"}, {"kind", "stop"}});
  FakeOutbox& newcomer = come(kHere);
  EXPECT_TRUE(first.closed);
  EXPECT_EQ(first.last_error(), "full");
  EXPECT_EQ(hub_.clients(), static_cast<std::size_t>(kPlaces));
  // For any number of newcomers: a paired client stays, and each newcomer may stop.
  for (int i = 0; i < 3 * kPlaces; ++i) come(kHere);
  EXPECT_FALSE(paired.closed);
  EXPECT_TRUE(newcomer.closed && stops.closed);
  const std::size_t before = requests_.size();
  come(kHere);
  say(last_, {{"type", "request"}, {"kind", "stop"}});
  EXPECT_EQ(requests_.size(), before + 1);
}

TEST_F(PlacesTest, WhoLosesItsPlaceMayStopAndWhoLeadsAStudyKeepsIt) {
  FakeOutbox leader;
  leader.this_user = true;
  const auto leads = greet(leader);
  say(leads, {{"type", "study"}, {"content", {{"text", "Reach."}}}});
  FakeOutbox& first = come(kHere);
  const auto evicted = last_;
  for (int i = 0; i < 3 * kPlaces; ++i) come(kHere);
  ASSERT_TRUE(first.closed);
  say(evicted, {{"type", "request"}, {"kind", "stop"}});
  EXPECT_EQ(requests_.size(), 1u);
  EXPECT_FALSE(leader.closed) << leader.last_words();
  EXPECT_EQ((*outboxes_.back()->last("study"))["content"]["text"], "Reach.");
  hub_.leave(leads, now_);
  FakeOutbox next;
  next.this_user = true;
  say(greet(next), {{"type", "study"}, {"content", {{"text", "Rest."}}}});
  EXPECT_EQ(next.last_error(), "") << "the study has ended";
}

TEST_F(PlacesTest, ACrowdTakesNoPlaceFromAnotherAddress) {
  const Address near{"192.0.2.7", false}, far{"198.51.100.1", false};
  FakeOutbox& here = come(kHere);
  FakeOutbox& headset = come(near);
  now_ += std::chrono::seconds(1);
  crowd(far);
  for (int i = 0; i < 3 * kPlaces; ++i) come(far);
  EXPECT_FALSE(here.closed || headset.closed);
  come(near);
  EXPECT_NE(last_, 0u);
  EXPECT_FALSE(here.closed || headset.closed);
}

TEST(Places, ANewcomerOfAnAddressThatIsThereReplacesItsOwn) {
  std::vector<Guest> guests;
  for (int i = 1; i <= 5; ++i)
    guests.push_back({static_cast<std::uint64_t>(i), {"address " + std::to_string(i), false}, {}});
  EXPECT_EQ(who_leaves(guests, {"address 3", false}), 3u);
  EXPECT_EQ(who_leaves(guests, {"elsewhere", false}), 1u);
  EXPECT_EQ(who_leaves({}, {"elsewhere", false}), std::nullopt);
}

TEST_F(PlacesTest, LoopbackKeepsItsPlacesHoweverManyAddressesThereAre) {
  std::vector<FakeOutbox*> here;
  for (int i = 0; i < kLoopbackPlaces; ++i) here.push_back(&come(kHere));
  for (int i = 0; i < 5 * kPlaces; ++i) come({"address " + std::to_string(i), false});
  EXPECT_TRUE(std::none_of(here.begin(), here.end(), [](const FakeOutbox* each) { return each->closed; }));
}

TEST_F(PlacesTest, APairedCrowdIsRefusedOnlyWhereAllPlacesAreKept) {
  std::vector<FakeOutbox> people(kPlaces);
  std::string token;
  for (FakeOutbox& person : people) {
    pair(person);
    token = (*person.last("paired"))["token"];
  }
  FakeOutbox late;
  EXPECT_EQ(hub_.join(late, kHere, now_), 0u);
  // Eight of a token keep their places; the ninth is a guest.
  hub_.shut_down();
  std::vector<FakeOutbox> tabs(kPlaces);
  for (FakeOutbox& tab : tabs) greet(tab, token);
  EXPECT_NE(hub_.join(late, kHere, now_), 0u);
}

TEST(ClientClock, FindsTheHandsTimeThroughDelays) {
  std::mt19937 random(7);
  std::exponential_distribution<double> extra(1.0 / 0.02);
  ClientClock clock;
  const double offset = -812.25, way = 0.004;  // session = client + offset
  double worst = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double t = 900.0 + i / 90.0;
    const Time arrival = from_seconds(t + offset + way + extra(random));
    clock.arrived(from_seconds(t), arrival);
    clock.round_trip(from_seconds(2 * way + extra(random)), arrival);
    const Time hand = clock.to_session(from_seconds(t), arrival);
    ASSERT_LE(hand, arrival);
    if (i > 500) worst = std::max(worst, std::abs(to_seconds(hand) - (t + offset)));
  }
  EXPECT_LT(worst, 0.002);
}

TEST(ClientClock, ForgetsAClockThatWasSetWithinTwoWindows) {
  ClientClock clock;
  for (int i = 0; i < 1200; ++i) {
    const double now = 100.0 + i * 0.01;
    const double t = now - (i < 100 ? 50.0 : 60.0);  // set back by 10 s after one second
    clock.arrived(from_seconds(t), from_seconds(now));
  }
  const Time now = from_seconds(112.0);
  EXPECT_NEAR(to_seconds(clock.to_session(from_seconds(52.0), now)), 112.0, 1e-6);
}

TEST_F(HubTest, AClockThatIsSetAheadIsFollowedOn) {
  FakeOutbox outbox;
  const auto id = pair(outbox);
  say(id, {{"type", "take"}});
  std::uint64_t sequence = 0;
  for (const double ahead : {0.0, 3.0, 3603.0}) {
    samples_.clear();
    for (int i = 0; i < 90; ++i) {
      now_ += from_seconds(1.0 / 90.0);
      const Time late = std::chrono::milliseconds(i % 7);
      say(id, sample(++sequence, to_seconds(now_ - late) + ahead));
      ASSERT_EQ(samples_.size(), i + 1u) << ahead << ": " << outbox.last_words();
      EXPECT_LE(now_ - samples_.back().stamp.hand, std::chrono::milliseconds(12));
      if (i > 0) {
        EXPECT_GT(samples_[i].stamp.hand, samples_[i - 1].stamp.hand);
      }
    }
  }
  EXPECT_EQ(outbox.count("error"), 0) << outbox.last_words();
}

TEST_F(HubTest, AClockThatIsSetBackIsUnderstoodAgainWithinTenSeconds) {
  FakeOutbox outbox;
  const auto id = pair(outbox);
  say(id, {{"type", "take"}});
  std::uint64_t sequence = 0;
  const auto send_for = [&](double seconds, double ahead) {
    samples_.clear();
    for (int i = 0; i < 90.0 * seconds; ++i) {
      now_ += from_seconds(1.0 / 90.0);
      say(id, sample(++sequence, to_seconds(now_) + ahead));
    }
  };
  send_for(1.0, 0.0);
  EXPECT_EQ(samples_.size(), 90u);
  send_for(1.0, -3.0);
  EXPECT_TRUE(samples_.empty());
  EXPECT_EQ(outbox.last_error(), "late");
  send_for(9.0, -3.0);
  send_for(1.0, -3.0);
  EXPECT_EQ(samples_.size(), 90u);
}

TEST_F(HubTest, AStudyIsShownToAllAndAnsweredToItsLeader) {
  FakeOutbox leader, stranger, page, late;
  leader.this_user = true;
  const auto leads = greet(leader), other = greet(stranger), operates = pair(page);
  say(other, {{"type", "study"}, {"content", {{"text", "mine"}}}});
  EXPECT_EQ(stranger.last_error(), "unpaired");
  say(operates, {{"type", "reply"}, {"content", {{"value", 1}}}});
  EXPECT_EQ(page.last_error(), "unknown") << "nobody leads one";

  say(leads, {{"type", "study"}, {"content", {{"text", "Reach."}}}});
  EXPECT_EQ((*page.last("study"))["content"]["text"], "Reach.");
  greet(late);
  EXPECT_EQ((*late.last("study"))["content"]["text"], "Reach.") << "who comes later sees it, too";
  say(operates, {{"type", "reply"}, {"content", {{"value", 12}}}});
  EXPECT_EQ((*leader.last("reply"))["client"], operates);
  EXPECT_EQ((*leader.last("reply"))["content"]["value"], 12);
  EXPECT_EQ(page.count("reply"), 0);
  say(other, {{"type", "reply"}, {"content", {{"value", 3}}}});
  EXPECT_EQ(leader.count("reply"), 1) << "who is not paired answers nothing";

  FakeOutbox second;
  second.this_user = true;
  say(greet(second), {{"type", "study"}, {"content", {{"text", "another"}}}});
  EXPECT_EQ(second.last_error(), "taken");
  hub_.leave(leads, now_);
  EXPECT_TRUE((*page.last("study"))["content"].is_null()) << "its leader has gone";
}

TEST_F(HubTest, TheLeaderOfAStudySetsConditionsUnlessAHandLeadsTheArm) {
  FakeOutbox leader, page;
  leader.this_user = true;
  const auto leads = greet(leader), operates = pair(page);
  say(operates, {{"type", "take"}});
  const Json latency = {{"type", "request"}, {"kind", "latency"}, {"value", 0.2}};
  say(leads, latency);
  EXPECT_EQ(leader.last_error(), "no_lease") << "before it leads one";
  say(leads, {{"type", "study"}, {"content", {{"text", "Rest."}}}});
  say(leads, latency);
  ASSERT_EQ(requests_.size(), 1u);
  EXPECT_EQ(requests_[0].kind, OperatorRequest::Kind::kLatency);
  say(leads, {{"type", "request"}, {"kind", "playback"}, {"text", "reach"}});
  EXPECT_EQ(requests_.size(), 1u) << "it leads no arm";
  OperatorView view;
  view.state = SupervisionState::kEngaged;
  hub_.broadcast_state(view);
  say(leads, latency);
  EXPECT_EQ(requests_.size(), 1u) << "a hand leads the arm";
  say(leads, {{"type", "request"}, {"kind", "playback"}, {"text", ""}});
  EXPECT_EQ(requests_.size(), 2u) << "a recording that plays is ended";
}

}  // namespace
}  // namespace steadyhand
