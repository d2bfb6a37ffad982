#include "serve/hub.hpp"

#include <gtest/gtest.h>

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
  void send(std::shared_ptr<const std::string> message) override {
    if (keep) messages.push_back(Json::parse(*message));
  }
  bool send_state(std::shared_ptr<const std::string>) override { return states++ > 0; }
  void close() override { closed = true; }

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
  bool has_lease() const {
    const Json* lease = last("lease");
    return lease && (*lease)["yours"].get<bool>();
  }
};

class HubTest : public testing::Test {
 protected:
  HubTest() {
    facts_.robot = "{}";
    facts_.profiles = {{"tracking", "Tracking", 0.0, 0.0}};
    facts_.recordings = {"reach"};
    facts_.objectives = {"lateral"};
    callbacks_.now = [this] { return now_; };
    callbacks_.on_sample = [this](const OperatorSample& sample) { samples_.push_back(sample); };
    callbacks_.on_request = [this](const OperatorRequest& request) { requests_.push_back(request); };
    callbacks_.on_lease = [this](std::uint64_t client) { leases_.push_back(client); };
    callbacks_.on_pairing = [](const auto&) {};
    EXPECT_TRUE(hub_.prepare());
  }

  std::uint64_t greet(FakeOutbox& outbox, const std::string& token = "") {
    const auto id = hub_.join(outbox, now_);
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
  Hub hub_{facts_, callbacks_, 250.0};
  std::vector<OperatorSample> samples_;
  std::vector<OperatorRequest> requests_;
  std::vector<std::uint64_t> leases_;
};

TEST_F(HubTest, RefusesAnotherVersionAndWhoDoesNotGreet) {
  FakeOutbox future, rude;
  say(hub_.join(future, now_), {{"type", "hello"}, {"version", 2}, {"new", "thing"}});
  EXPECT_EQ(future.last_error(), "version");
  EXPECT_TRUE(future.closed);
  say(hub_.join(rude, now_), {{"type", "take"}});
  EXPECT_TRUE(rude.closed);
  EXPECT_TRUE(leases_.empty());
}

TEST_F(HubTest, TakesACodeOnce) {
  FakeOutbox a, b;
  const std::string code = hub_.code();
  pair(a);
  ASSERT_TRUE(a.last("paired"));
  const auto late = greet(b);
  say(late, {{"type", "pair"}, {"code", code}});
  EXPECT_EQ(b.last_error(), "code");
  EXPECT_NE(hub_.code(), code);
}

TEST_F(HubTest, RefusesEvenTheRightCodeAfterManyWrongOnes) {
  FakeOutbox a;
  const auto id = greet(a);
  for (int i = 0; i < Pairing::kMaxFailures; ++i) say(id, {{"type", "pair"}, {"code", "wrong"}});
  say(id, {{"type", "pair"}, {"code", hub_.code()}});
  EXPECT_FALSE(a.last("paired"));
  now_ += Pairing::kFailureWindow;
  say(id, {{"type", "pair"}, {"code", hub_.code()}});
  EXPECT_TRUE(a.last("paired"));
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
  hub_.leave(second);
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

/// Mutated good messages and noise from clients that may not command, 100,000 of them: none moves anything.
TEST_F(HubTest, FuzzNeverCommands) {
  MessageFuzz fuzz(20240601);
  FakeOutbox outbox;
  outbox.keep = false;
  std::uint64_t id = 0;
  for (int i = 0; i < 100'000; ++i) {
    if (i % 16 == 0) {  // a client is closed after a few
      hub_.leave(id);
      outbox.closed = false;
      id = greet(outbox);
    }
    now_ += from_seconds(0.005);
    hub_.receive(id, fuzz.next(), now_);
  }
  EXPECT_TRUE(samples_.empty());
  EXPECT_TRUE(leases_.empty());
  EXPECT_TRUE(requests_.empty());
  EXPECT_GT(hub_.refused_messages, 10'000u);
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

}  // namespace
}  // namespace steadyhand
