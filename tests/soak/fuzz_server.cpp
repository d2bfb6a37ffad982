// fuzz_server [MESSAGES] [SEED]: hostile messages to the server's hub, by turns
// from clients that may not command and from the one that holds the lease; 10
// million by default. Build it with the preset asan. Exit code 1: a command
// got through that must not, or none that may.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "steadyhand/operator/protocol/hub.hpp"
#include "support/message_fuzz.hpp"

namespace steadyhand {
namespace {

struct Deaf : Outbox {
  void send(std::shared_ptr<const std::string>) override {}
  bool send_state(std::shared_ptr<const std::string>) override { return false; }
  void close() override {}
  bool of_this_user() override { return false; }
};

class Campaign {
 public:
  explicit Campaign(std::uint32_t seed) : fuzz_(seed) {
    facts_.terms = {{"lateral", "Liquid", "1"}};
    facts_.profiles = {{"tracking", "Tracking", {0.0}}};
    callbacks_.now = [this] { return now_; };
    callbacks_.on_sample = [this](const OperatorSample& sample) {
      const Vector3& p = sample.X_operator_hand.p;
      const bool good = p.allFinite() && p.cwiseAbs().maxCoeff() <= 1000.0 &&
                        std::abs(sample.X_operator_hand.q.norm() - 1.0) < 1e-9 && sample.stamp.made == now_ &&
                        sample.stamp.hand <= now_ && now_ - sample.stamp.hand <= Hub::kOldest;
      judge(good);
    };
    callbacks_.on_request = [this](const OperatorRequest& request) -> Status {
      using Kind = OperatorRequest::Kind;
      if (request.kind == Kind::kStop) return Done{};
      const bool known = request.kind == Kind::kWeight    ? request.text == "lateral"
                         : request.kind == Kind::kProfile ? request.text == "tracking"
                                                          : request.text.empty();
      judge(known && std::isfinite(request.value) && std::abs(request.value) <= 1e6);
      return Done{};
    };
    callbacks_.on_lease = [this](std::uint64_t client) { wrong_ += client != 0 && client != leader_; };
    callbacks_.on_pairing = [](const auto&) {};
  }

  bool run(long long messages) {
    if (!hub_.prepare()) return false;
    for (long long i = 0; i < messages; ++i) {
      now_ += std::chrono::milliseconds(5);
      if (i % 16 == 0) begin_client(i % 32 == 0);  // a client is closed after a few
      say(fuzz_.next());
      if (i % 1000 == 0) hub_.tick(now_);
    }
    std::printf(
        "%lld messages, %llu refused; with the lease %lld commands, "
        "%lld others got through\n",
        messages, static_cast<unsigned long long>(hub_.refused_messages), led_, wrong_);
    return wrong_ == 0 && led_ > 0;
  }

 private:
  void judge(bool good) {
    const bool may = leader_ != 0 && hub_.holder() == leader_;
    ++(good && may ? led_ : wrong_);
  }

  void begin_client(bool leads) {
    leader_ = 0;
    hub_.leave(client_, now_);
    client_ = hub_.join(outbox_, {"loopback", true}, now_);
    say(R"({"type":"hello","version":2})");
    if (!leads) return;
    leader_ = client_;
    say(R"({"type":"pair","code":")" + hub_.code() + "\"}");
    say(R"({"type":"take"})");
  }

  void say(const std::string& message) {
    if (message.size() <= kMaxClientMessage) hub_.receive(client_, message, now_);
  }

  ServerFacts facts_;
  ServerCallbacks callbacks_;
  Hub hub_{facts_, callbacks_, 250.0, 96};
  Deaf outbox_;
  MessageFuzz fuzz_;
  Time now_ = std::chrono::seconds(100);
  std::uint64_t client_ = 0, leader_ = 0;  // 0: this one may not command
  long long led_ = 0, wrong_ = 0;
};

}  // namespace
}  // namespace steadyhand

int main(int argc, char** argv) {
  const long long messages = argc > 1 ? std::atoll(argv[1]) : 10'000'000;
  const auto seed = static_cast<std::uint32_t>(argc > 2 ? std::atoll(argv[2]) : 1);
  if (messages <= 0) {
    std::fprintf(stderr, "fuzz_server [MESSAGES > 0] [SEED]\n");
    return 2;
  }
  return steadyhand::Campaign(seed).run(messages) ? 0 : 1;
}
