// Control: the part of the hub that gives, takes and passes on the lease.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/operator/protocol/hub.hpp"

namespace steadyhand {

void Hub::handle(std::uint64_t id, Client&, const ReleaseMessage&, Time now) {
  if (asker_ == id) end_asking(now);
  if (holder_ == id) give_lease(0, now);
}

void Hub::handle(std::uint64_t id, Client& client, const TakeMessage&, Time now) {
  if (!takes(id, client, now)) {
    refuse(client, Refusal::kTaken, "another client has control; you can ask for it");
  }
}

void Hub::handle(std::uint64_t id, Client& client, const AskMessage&, Time now) {
  if (!takes(id, client, now)) ask(id, client, now);
}

/// True if nothing more is to be done: the client has control now, or was refused.
bool Hub::takes(std::uint64_t id, Client& client, Time now) {
  if (client.token.empty()) {
    refuse(client, Refusal::kUnpaired, "pair with the code from the terminal first");
  } else if (holder_ != id && may_take(id, client)) {
    give_lease(id, now);
  } else {
    return holder_ == id;
  }
  return true;
}

void Hub::handle(std::uint64_t id, Client& client, const AnswerMessage& message, Time now) {
  if (holder_ != id) return refuse(client, Refusal::kNoLease, "only the client that has control may pass it on");
  const auto asker = clients_.find(asker_);
  if (asker == clients_.end()) return;  // it no longer asks
  if (message.grant) return give_lease(asker_, now);
  asker->second.ask_after = now + kAskTimeout;
  refuse(asker->second, Refusal::kTaken, "the other operator keeps control");
  end_asking(now);
}

bool Hub::may_take(std::uint64_t id, const Client& client) const {
  if (client.token.empty() || holder_ == id) return false;
  const auto holder = clients_.find(holder_);
  return holder == clients_.end() || holder->second.token == client.token;
}

void Hub::ask(std::uint64_t id, Client& client, Time now) {
  if (asker_ == id) return;
  if (asker_ != 0) return refuse(client, Refusal::kTaken, "another client already asks for control");
  if (now < client.ask_after) {
    return refuse(client, Refusal::kTaken,
                  fmt::format("the other operator keeps control; ask again in {:.0f} s",
                              std::ceil(to_seconds(client.ask_after - now))));
  }
  asker_ = id;
  idle_since_ = led(now) ? std::nullopt : std::optional(now);
  tell_lease(now);
}

/// Whether a hand or a recording controls the arm.
bool Hub::led(Time now) const { return arm_led_ || now - kOldest < last_grip_; }

void Hub::end_asking(Time now) {
  asker_ = 0;
  tell_lease(now);
}

/// Gives control to the client that asked once the arm is idle for long enough. An engaged arm is not taken away.
void Hub::watch_asking(Time now) {
  if (asker_ == 0) return;
  const bool idle = !led(now);
  if (idle && idle_since_ && now - *idle_since_ >= kAskTimeout) return give_lease(asker_, now);
  if (idle == idle_since_.has_value()) return;
  idle_since_ = idle ? std::optional(now) : std::nullopt;
  tell_lease(now);
}

void Hub::give_lease(std::uint64_t id, Time now) {
  if (id == 0) id = asker_;
  if (id == asker_) asker_ = 0;
  holder_ = id;
  last_grip_ = Time::min();
  idle_since_ = now;
  const auto found = clients_.find(id);
  const bool code_used = found != clients_.end() && pairing_.use_up(found->second.token);
  if (found != clients_.end()) found->second.newest = {};
  callbacks_.on_lease(id);
  tell_lease(now);
  if (code_used) callbacks_.on_pairing({});
}

LeaseMessage Hub::lease_of(std::uint64_t id, const Client& client, Time now) const {
  LeaseMessage view{holder_, holder_ == id, may_take(id, client), asker_, {}};
  if (asker_ != 0 && idle_since_) view.left = std::max(Time(0), *idle_since_ + kAskTimeout - now);
  return view;
}

void Hub::tell_lease(Time now) {
  for (auto& [id, client] : clients_) {
    if (client.greeted) send(client, to_json(lease_of(id, client, now)));
  }
}

}  // namespace steadyhand
