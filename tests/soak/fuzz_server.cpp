// fuzz_server [MESSAGES] [SEED]: hostile messages to the server's hub, from clients that may not command; 10 million by
// default. Build it with the preset asan. Exit code 1: one of them got through.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "serve/hub.hpp"
#include "support/message_fuzz.hpp"

namespace steadyhand {
namespace {

struct Deaf : Outbox {
  void send(std::shared_ptr<const std::string>) override {}
  bool send_state(std::shared_ptr<const std::string>) override { return false; }
  void close() override {}
};

int run(long long messages, std::uint32_t seed) {
  long long commands = 0;
  ServerFacts facts;
  facts.objectives = {"lateral"};
  ServerCallbacks callbacks;
  callbacks.now = [] { return Time(0); };
  callbacks.on_sample = [&](const OperatorSample&) { ++commands; };
  callbacks.on_request = [&](const OperatorRequest& r) { commands += r.kind != OperatorRequest::Kind::kStop; };
  callbacks.on_lease = [&](std::uint64_t) { ++commands; };
  callbacks.on_pairing = [&](const auto&) { ++commands; };
  Hub hub(facts, callbacks, 250.0, 96);
  if (!hub.prepare()) return 1;
  Deaf outbox;
  MessageFuzz fuzz(seed);
  Time now = std::chrono::seconds(100);
  std::uint64_t client = 0;
  for (long long i = 0; i < messages; ++i) {
    now += std::chrono::milliseconds(5);
    if (i % 16 == 0) {  // a client is closed after a few
      hub.leave(client, now);
      client = hub.join(outbox, {"loopback", true}, now);
      hub.receive(client, R"({"type":"hello","version":1})", now);
    }
    hub.receive(client, fuzz.next(), now);
    if (i % 1000 == 0) hub.tick(now);
  }
  std::printf("%lld messages, %llu refused, %lld commands got through\n", messages,
              static_cast<unsigned long long>(hub.refused_messages), commands);
  return commands == 0 ? 0 : 1;
}

}  // namespace
}  // namespace steadyhand

int main(int argc, char** argv) {
  const long long messages = argc > 1 ? std::atoll(argv[1]) : 10'000'000;
  const auto seed = static_cast<std::uint32_t>(argc > 2 ? std::atoll(argv[2]) : 1);
  if (messages <= 0) {
    std::fprintf(stderr, "fuzz_server [MESSAGES > 0] [SEED]\n");
    return 2;
  }
  return steadyhand::run(messages, seed);
}
