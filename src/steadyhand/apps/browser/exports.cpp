// What JavaScript calls of a WebAssembly module, and what it lends to it: see web/src/worker/module.ts.
#ifdef __wasm__

#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <typeinfo>

#include "steadyhand/apps/browser/browser_session.hpp"
#include "steadyhand/apps/browser/closed_loop.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/files/record/model_json.hpp"

#define STEADYHAND_EXPORT(name) extern "C" __attribute__((export_name(#name)))
#define STEADYHAND_IMPORT(name) extern "C" __attribute__((import_module("steadyhand"), import_name(#name)))

STEADYHAND_IMPORT(send) void page_send(unsigned client, const char* text, std::size_t size, int is_state);
STEADYHAND_IMPORT(close) void page_close(unsigned client);
/// More of a recording, after which, if there are no bytes, it is complete.
STEADYHAND_IMPORT(keep)
void page_keep(const char* name, std::size_t name_size, const char* bytes, std::size_t size);
/// The reason why there is no session, or none any more.
STEADYHAND_IMPORT(say) void page_say(const char* text, std::size_t size);

namespace {

using namespace steadyhand;

void keep(std::string_view name, std::string_view bytes) {
  page_keep(name.data(), name.size(), bytes.data(), bytes.size());
}

void say(const std::string& text) { page_say(text.data(), text.size()); }

/// A page at the far end of a message port.
class PortOutbox final : public Outbox {
 public:
  void send(std::shared_ptr<const std::string> message) override {
    page_send(number, message->data(), message->size(), 0);
  }
  /// The Worker keeps the newest until the page has taken the one before, and counts none.
  bool send_state(std::shared_ptr<const std::string> message) override {
    page_send(number, message->data(), message->size(), 1);
    return false;
  }
  void close() override { page_close(number); }
  bool of_this_user() override { return true; }

  unsigned number = 0;  ///< JavaScript's
};

struct Client {
  PortOutbox outbox;
  std::uint64_t id = 0;  ///< the hub's
};

std::unique_ptr<BrowserSession> session;
std::map<unsigned, Client> clients;
std::string answer;  ///< from the last call that has one

Time wall() {
  static MonotonicClock clock;
  return clock.now();
}

}  // namespace

// Nothing catches: what throws ends the module, with its words where they are known.
extern "C" void* __cxa_allocate_exception(std::size_t size) { return std::malloc(size); }
extern "C" void __cxa_free_exception(void* exception) { std::free(exception); }
extern "C" [[noreturn]] void __cxa_throw(void* exception, std::type_info* type, void (*)(void*)) {
  if (*type == typeid(json::Wrong)) {
    say(static_cast<json::Wrong*>(exception)->message);
  } else {
    say(std::string("an exception of type ") + type->name());
  }
  __builtin_trap();
}

STEADYHAND_EXPORT(take_memory) void* take_memory(std::size_t size) { return std::malloc(size); }
STEADYHAND_EXPORT(give_memory) void give_memory(void* memory) { std::free(memory); }

/// @param text of setup_json(). 0: there is a session; 1: there is none, and the reason was said
STEADYHAND_EXPORT(begin) int begin(const char* text, std::size_t size, double rate_hz) {
  Result<BrowserSetup> setup = read_setup_json({text, size});
  if (!setup) return say(setup.error().message), 1;
  auto made = BrowserSession::make(*std::move(setup), wall, rate_hz, keep);
  if (!made) return say(made.error().message), 1;
  session = *std::move(made);
  return 0;
}

/// All times: s, of one monotonic clock.
STEADYHAND_EXPORT(advance) void advance(double now) { session->advance(from_seconds(now)); }

/// Of pauses, see BrowserSession.
STEADYHAND_EXPORT(left_out) double left_out() { return to_seconds(session->left_out()); }

STEADYHAND_EXPORT(join) void join(unsigned number, double now) {
  Client& client = clients[number];
  client.outbox.number = number;
  client.id = session->join(client.outbox, from_seconds(now));
  if (client.id == 0) page_close(number);
}

STEADYHAND_EXPORT(leave) void leave(unsigned number, double now) {
  const auto found = clients.find(number);
  if (found == clients.end()) return;
  session->leave(found->second.id, from_seconds(now));
  clients.erase(found);
}

STEADYHAND_EXPORT(receive) void receive(unsigned number, const char* text, std::size_t size, double now) {
  const auto found = clients.find(number);
  if (found != clients.end()) session->receive(found->second.id, {text, size}, from_seconds(now));
}

/// The answer of the last call that has one; see answer_size().
STEADYHAND_EXPORT(answer_text) const char* answer_text() { return answer.data(); }
STEADYHAND_EXPORT(answer_size) std::size_t answer_size() { return answer.size(); }

/// closed_loop() with the setup's profile of this index; 1: refused, and the reason was said.
STEADYHAND_EXPORT(solve) int solve(const char* text, std::size_t size, int profile, int problems) {
  const Result<BrowserSetup> setup = read_setup_json({text, size});
  if (!setup) return say(setup.error().message), 1;
  const Result<std::string> solved = closed_loop(*setup, profile, problems, wall);
  if (!solved) return say(solved.error().message), 1;
  answer = *solved;
  return 0;
}

/// A session of so many seconds without an operator, whose clock and planner are those of the setup alone: its
/// commands, see commands_of().
STEADYHAND_EXPORT(play) int play(const char* text, std::size_t size, double seconds) {
  Result<BrowserSetup> setup = read_setup_json({text, size});
  if (!setup) return say(setup.error().message), 1;
  const Result<std::string> commands = commands_of(*std::move(setup), seconds);
  if (!commands) return say(commands.error().message), 1;
  answer = *commands;
  return 0;
}

#endif
