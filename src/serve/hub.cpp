#include "serve/hub.hpp"

#include <algorithm>
#include <utility>

namespace steadyhand {

Hub::Hub(const ServerFacts& facts, const ServerCallbacks& callbacks, double max_rate_hz)
    : facts_(facts), callbacks_(callbacks), max_rate_hz_(max_rate_hz) {}

std::uint64_t Hub::join(Outbox& outbox, Time now) {
  const std::uint64_t id = ++last_id_;
  Client& client = clients_[id];
  client.outbox = &outbox;
  client.last_message = now;
  client.allowance = max_rate_hz_;
  client.allowance_at = now;
  return id;
}

void Hub::leave(std::uint64_t id) {
  if (!clients_.erase(id)) return;
  if (holder_ == id) give_lease(0);
}

void Hub::receive(std::uint64_t id, std::string_view text, Time now) {
  const auto found = clients_.find(id);
  if (found == clients_.end() || found->second.closed) return;
  Client& client = found->second;
  client.last_message = now;
  const bool in_time = within_rate(client, now);
  if (client.closed) return;
  const Result<ClientMessage> message = parse_client_message(text);
  if (!message) {
    refuse(client, Refusal::kMalformed, message.error().message);
    if (++client.strikes > kMaxStrikes) close(client);
    return;
  }
  // A stop counts whoever sends it, whatever it sent before and however much.
  const auto* request = std::get_if<RequestMessage>(&*message);
  if (request && request->request.kind == OperatorRequest::Kind::kStop) return handle(id, client, *request, now);
  if (!in_time) {
    return complain(client, Refusal::kTooMany, "more messages than one client may send; some are discarded", now);
  }
  if (!client.greeted && !std::holds_alternative<HelloMessage>(*message)) {
    refuse(client, Refusal::kVersion, "the first message must be hello, with the protocol's version");
    return close(client);
  }
  std::visit([&](const auto& m) { handle(id, client, m, now); }, *message);
}

/// Token bucket of one second's worth of messages.
bool Hub::within_rate(Client& client, Time now) {
  client.allowance = std::min(max_rate_hz_, client.allowance + to_seconds(now - client.allowance_at) * max_rate_hz_);
  client.allowance_at = now;
  if (client.allowance >= 1.0) {
    client.allowance -= 1.0;
    if (client.allowance > 0.5 * max_rate_hz_) client.excess = 0;
    return true;
  }
  if (++client.excess > 10.0 * max_rate_hz_) {
    refuse(client, Refusal::kTooMany, "far more messages than one client may send");
    close(client);
  }
  return false;
}

void Hub::tick(Time now) {
  const auto holder = clients_.find(holder_);
  if (holder != clients_.end() && now - holder->second.last_message > kLeaseSilence) give_lease(0);
}

void Hub::broadcast_state(const SessionSnapshot& snapshot) {
  std::shared_ptr<const std::string> message;
  for (auto& [id, client] : clients_) {
    if (!client.greeted || client.closed) continue;
    if (!message) message = std::make_shared<const std::string>(state_message(snapshot));
    if (client.outbox->send_state(message)) ++states_skipped;
  }
}

void Hub::shut_down() {
  clients_.clear();
  holder_ = 0;
}

void Hub::handle(std::uint64_t id, Client& client, const HelloMessage& message, Time) {
  if (message.version != kProtocolVersion) {
    refuse(client, Refusal::kVersion,
           "this program speaks version " + std::to_string(kProtocolVersion) + " of the protocol, not " +
               std::to_string(message.version) + "; reload the page");
    return close(client);
  }
  if (client.greeted) return refuse(client, Refusal::kMalformed, "hello was said already");
  client.greeted = true;
  send(client, welcome_message(facts_, id));
  if (pairing_.known(message.token)) {
    client.token = message.token;
    send(client, paired_message(client.token));
  }
  send(client, lease_message(holder_, false));
}

void Hub::handle(std::uint64_t, Client& client, const PairMessage& message, Time now) {
  std::string token = pairing_.redeem(message.code, now);
  if (token.empty()) {
    return refuse(client, Refusal::kCode,
                  "this code is wrong or used up; the terminal shows the one that is valid now");
  }
  client.token = std::move(token);
  send(client, paired_message(client.token));
  callbacks_.on_pairing({});
}

void Hub::handle(std::uint64_t id, Client& client, const LeaseMessage& message, Time) {
  if (!message.take) {
    if (holder_ == id) give_lease(0);
    return;
  }
  if (client.token.empty()) return refuse(client, Refusal::kUnpaired, "pair with the code from the terminal first");
  if (holder_ == id) return;
  const auto holder = clients_.find(holder_);
  if (holder != clients_.end() && holder->second.token != client.token) {
    return refuse(client, Refusal::kTaken, "client " + std::to_string(holder_) + " commands the arm now");
  }
  give_lease(id);
}

void Hub::handle(std::uint64_t id, Client& client, const SampleMessage& message, Time now) {
  if (holder_ != id) {
    ++samples_dropped;
    return complain(client, Refusal::kNoLease, "only the client that holds the lease moves the arm", now);
  }
  const bool in_order = !client.any_sample || (message.sequence > client.last_sequence && message.t >= client.last_t);
  const Time t = from_seconds(message.t);
  client.clock.arrived(t, now);
  const Time hand = client.clock.to_session(t, now);
  if (!in_order || now - hand > kOldest) {
    ++samples_dropped;
    return;
  }
  client.any_sample = true;
  client.last_sequence = message.sequence;
  client.last_t = message.t;
  OperatorSample sample = message.sample;
  sample.stamp = {hand, now};
  ++samples;
  callbacks_.on_sample(sample);
}

void Hub::handle(std::uint64_t id, Client& client, const RequestMessage& message, Time) {
  if (message.request.kind != OperatorRequest::Kind::kStop && holder_ != id) {
    return refuse(client, Refusal::kNoLease, "only the client that holds the lease may ask for this; any may stop");
  }
  const auto& [kind, text, value] = message.request;
  const auto holds = [&text = text](const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), text) != names.end();
  };
  const auto named = [&text = text](const ServerFacts::Profile& profile) { return profile.name == text; };
  if (kind == OperatorRequest::Kind::kProfile && std::none_of(facts_.profiles.begin(), facts_.profiles.end(), named)) {
    return refuse(client, Refusal::kUnknown, "no profile has this name");
  }
  if (kind == OperatorRequest::Kind::kPlayback && !text.empty() && !holds(facts_.recordings)) {
    return refuse(client, Refusal::kUnknown, "no built-in recording has this name");
  }
  if (kind == OperatorRequest::Kind::kWeight && !holds(facts_.objectives)) {
    return refuse(client, Refusal::kUnknown, "no term of the objective has this name");
  }
  if ((kind == OperatorRequest::Kind::kScale || kind == OperatorRequest::Kind::kRate) && value <= 0.0) {
    return refuse(client, Refusal::kMalformed, "'value' of a scale or rate must be above 0");
  }
  callbacks_.on_request(message.request);
}

void Hub::handle(std::uint64_t, Client& client, const PingMessage& message, Time now) {
  client.clock.arrived(from_seconds(message.t), now);
  if (message.echo >= 0.0) client.clock.round_trip(now - from_seconds(message.echo) - from_seconds(message.held), now);
  send(client, pong_message(message.t, now));
}

void Hub::give_lease(std::uint64_t id) {
  holder_ = id;
  const auto found = clients_.find(id);
  if (found != clients_.end()) found->second.any_sample = false;
  callbacks_.on_lease(id);
  tell_lease();
}

void Hub::tell_lease() {
  for (auto& [id, client] : clients_) {
    if (client.greeted) send(client, lease_message(holder_, id == holder_));
  }
}

void Hub::refuse(Client& client, Refusal refusal, std::string_view message) {
  ++refused_messages;
  send(client, error_message(refusal, message));
}

/// For what may come with every message: said once a second.
void Hub::complain(Client& client, Refusal refusal, std::string_view message, Time now) {
  if (client.complained && now - *client.complained < std::chrono::seconds(1)) {
    ++refused_messages;
    return;
  }
  client.complained = now;
  refuse(client, refusal, message);
}

void Hub::close(Client& client) {
  client.closed = true;
  client.outbox->close();
}

void Hub::send(Client& client, std::string message) {
  if (!client.closed) client.outbox->send(std::make_shared<const std::string>(std::move(message)));
}

}  // namespace steadyhand
