// WebSocket messages: the first byte says who sends them, the rest are messages, a line each.
#include <cmath>

#include "fuzz/fuzz.hpp"
#include "steadyhand/operator/protocol/hub.hpp"

namespace steadyhand {
namespace {

using fuzz::require;

struct Deaf : Outbox {
  void send(std::shared_ptr<const std::string>) override {}
  bool send_state(std::shared_ptr<const std::string>) override { return false; }
  void close() override {}
  bool of_this_user() override { return false; }
};

ServerFacts facts() {
  ServerFacts facts;
  facts.profiles = {{"waiter", "Waiter", {1.0}}};
  facts.terms = {{"lateral", "Liquid", "1"}};
  facts.recordings = {"carrying"};
  return facts;
}

/// A hub with one client, of whose messages nothing gets through that may not.
class Session {
 public:
  explicit Session(bool with_lease) : with_lease_(with_lease) {
    callbacks_.now = [this] { return now_; };
    callbacks_.on_sample = [this](const OperatorSample& sample) { check(sample); };
    callbacks_.on_request = [this](const OperatorRequest& request) {
      check(request);
      return Status(Done{});
    };
    callbacks_.on_lease = [this](std::uint64_t client) { require(client == 0 || with_lease_, "no lease unpaired"); };
    callbacks_.on_pairing = [](const auto&) {};
    require(static_cast<bool>(hub_.prepare()), "random numbers");
    client_ = hub_.join(outbox_, Address{}, now_);
    if (!with_lease) return;
    receive(R"({"type":"hello","version":3})");
    receive(R"({"type":"pair","code":")" + hub_.code() + R"("})");
    receive(R"({"type":"take"})");
    require(hub_.holder() == client_, "a paired client takes the lease");
  }
  ~Session() {
    with_lease_ = true;
    hub_.leave(client_, now_);
  }

  void receive(std::string_view text) {
    now_ += std::chrono::milliseconds(7);
    hub_.receive(client_, text, now_);
    hub_.tick(now_);
  }

 private:
  void check(const OperatorSample& sample) {
    require(with_lease_ && hub_.holder() == client_, "no hand without the lease");
    require(sample.X_operator_hand.p.allFinite(), "a hand somewhere");
    require(std::abs(sample.X_operator_hand.q.norm() - 1.0) < 1e-9, "a hand's rotation");
    require(sample.stamp.hand <= now_ && (!sample.clutch || now_ - sample.stamp.hand <= Hub::kOldest),
            "no hand of the future, none too old");
    require(sample.stamp.hand >= last_ - Hub::kOldest, "hands in order");
    last_ = std::max(last_, sample.stamp.hand);
  }
  void check(const OperatorRequest& request) {
    using Kind = OperatorRequest::Kind;
    if (request.kind == Kind::kStop) return;
    require(with_lease_ && hub_.holder() == client_, "nothing but a stop without the lease");
    require(std::isfinite(request.value), "a number");
    if (request.kind == Kind::kProfile) require(request.text == "waiter", "a profile that there is");
    if (request.kind == Kind::kWeight)
      require(request.text == "lateral" && request.value >= 0.0, "a term that there is");
    if (request.kind == Kind::kPlayback) require(request.text.empty() || request.text == "carrying", "a recording");
    if (request.kind == Kind::kScale || request.kind == Kind::kRate) require(request.value > 0.0, "above 0");
  }

  bool with_lease_;
  Time now_ = std::chrono::seconds(100), last_{0};
  ServerFacts facts_ = facts();
  ServerCallbacks callbacks_;
  Deaf outbox_;
  Hub hub_{facts_, callbacks_, 250.0, 96};
  std::uint64_t client_ = 0;
};

}  // namespace

FUZZ(messages) {
  if (input.empty()) return;
  Session session(input.front() == 'L');
  input.remove_prefix(1);
  while (!input.empty()) {
    const std::size_t length = std::min(input.find('\n'), input.size());
    session.receive(input.substr(0, length));
    input.remove_prefix(std::min(length + 1, input.size()));
  }
}

}  // namespace steadyhand
