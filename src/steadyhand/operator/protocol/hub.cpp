#include "steadyhand/operator/protocol/hub.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace steadyhand {

Hub::Hub(const ServerFacts& facts, const ServerCallbacks& callbacks, double max_rate_hz, int max_clients)
    : facts_(facts),
      callbacks_(callbacks),
      max_rate_hz_(max_rate_hz * facts.tools),
      max_clients_(static_cast<std::size_t>(std::max(max_clients, 1))) {}

std::uint64_t Hub::join(Outbox& outbox, const Address& address, Time now) {
  if (!make_room(address, now)) return 0;
  const std::uint64_t id = ++last_id_;
  Client& client = clients_[id];
  client.outbox = &outbox;
  client.address = address;
  client.useful = now;
  client.last_message = now;
  client.allowance = max_rate_hz_;
  client.allowance_at = now;
  return id;
}

/// Clients with a role stay, and kEach paired clients of each token; all others are guests.
bool Hub::make_room(const Address& newcomer, Time now) {
  if (clients_.size() < max_clients_) return true;
  constexpr int kEach = 8;
  std::map<std::string_view, int> paired;
  std::vector<Guest> guests;
  for (auto it = clients_.rbegin(); it != clients_.rend(); ++it) {  // the newest first
    const auto& [id, client] = *it;
    const bool has_role = id == holder_ || id == asker_ || id == policy_ || id == study_leader_;
    const bool stays = has_role || (!client.token.empty() && ++paired[client.token] <= kEach);
    if (!stays) guests.push_back({id, client.address, client.useful});
  }
  const auto guest = who_leaves(guests, newcomer);
  if (!guest) return false;
  const auto found = clients_.find(*guest);
  refuse(found->second, Refusal::kFull, "all places are taken: pair to keep yours");
  close(found->second);
  leave(*guest, now);
  return true;
}

void Hub::leave(std::uint64_t id, Time now) {
  if (!clients_.erase(id)) return;
  if (asker_ == id) end_asking(now);
  if (holder_ == id) give_lease(0, now);
  if (study_leader_ == id) tell_study("null");
  if (policy_ == id) {
    policy_ = 0;
    (void)callbacks_.on_policy(std::nullopt);
  }
}

void Hub::receive(std::uint64_t id, std::string_view text, Time now) {
  const auto found = clients_.find(id);
  const bool listened_to = found != clients_.end() && !found->second.closed;
  const bool in_time = listened_to && within_rate(found->second, now);
  const Result<ClientMessage> message = parse_client_message(text);
  // A stop counts from every client, after all it sent before, until its socket is closed.
  const auto* request = message ? std::get_if<RequestMessage>(&*message) : nullptr;
  if (request && request->request.kind == OperatorRequest::Kind::kStop) return stop(id, now);
  if (!listened_to || found->second.closed) return;
  Client& client = found->second;
  client.last_message = now;
  if (!message) {
    refuse(client, Refusal::kMalformed, message.error().message);
    if (++client.strikes > kMaxStrikes) close(client);
    return;
  }
  if (!in_time) {
    return complain(client, Refusal::kTooMany, "more messages than one client may send; some are discarded", now);
  }
  if (!client.greeted && !std::holds_alternative<HelloMessage>(*message)) {
    refuse(client, Refusal::kVersion, "the first message must be hello, with the protocol's version");
    return close(client);
  }
  std::visit([&](const auto& m) { handle(id, client, m, now); }, *message);
}

void Hub::receive_frame(std::uint64_t id, Time now) {
  const auto found = clients_.find(id);
  if (found == clients_.end() || found->second.closed) return;
  (void)within_rate(found->second, now);
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
  for (auto& [id, client] : clients_) {
    if (!client.code || client.closed || now < client.next_code) continue;
    pair(id, client, *std::exchange(client.code, std::nullopt), now);
  }
  const auto silent = [&](std::uint64_t id) {
    const auto found = clients_.find(id);
    return found != clients_.end() && now - found->second.last_message > kLeaseSilence;
  };
  if (silent(asker_)) end_asking(now);
  if (silent(holder_)) give_lease(0, now);
  watch_asking(now);
}

void Hub::broadcast_state(const OperatorView& view) {
  arm_led_ = view.state == SupervisionState::kEngaged || view.state == SupervisionState::kHolding;
  if (view.cell && view.cell != cell_) {
    cell_ = view.cell;
    const std::string changed = to_json(CellMessage{{*cell_}});
    for (auto& [id, client] : clients_) {
      if (client.greeted && !client.closed) send(client, changed);
    }
  }
  if (view.cameras_ended && view.cameras_ended != cameras_ended_) {
    cameras_ended_ = view.cameras_ended;
    const std::string changed = to_json(CamerasMessage{*cameras_ended_});
    for (auto& [id, client] : clients_) {
      if (client.greeted && !client.closed) send(client, changed);
    }
  }
  std::shared_ptr<const std::string> message;
  for (auto& [id, client] : clients_) {
    if (!client.greeted || client.closed) continue;
    if (!message) message = std::make_shared<const std::string>(to_json(view));
    if (client.outbox->send_state(message)) ++states_skipped;
  }
}

void Hub::broadcast_picture(int camera, bool is_key, const std::shared_ptr<const std::string>& message) {
  using Watch = Client::Watch;
  for (auto& [id, client] : clients_) {
    if (client.closed || camera >= std::ssize(client.watches)) continue;
    Watch& watch = client.watches[static_cast<std::size_t>(camera)];
    if (watch == Watch::kNot || (watch == Watch::kFromKey && !is_key)) continue;
    watch = client.outbox->send_picture(message, camera, is_key) ? Watch::kAll : Watch::kFromKey;
    pictures_skipped += watch == Watch::kFromKey;
  }
}

std::optional<Hub::Reader> Hub::reader(std::string_view secret) const {
  const std::string token = pairing_.token_of(secret);
  if (token.empty()) return std::nullopt;
  const auto holder = clients_.find(holder_);
  return Reader{pairing_.reading_key(token), holder != clients_.end() && holder->second.token == token};
}

std::size_t Hub::say_farewell() {
  for (auto& [id, client] : clients_) close(client);
  return clients_.size();
}

void Hub::shut_down() {
  clients_.clear();
  holder_ = asker_ = study_leader_ = policy_ = 0;
}

void Hub::handle(std::uint64_t id, Client& client, const HelloMessage& message, Time now) {
  if (message.version != kProtocolVersion) {
    refuse(client, Refusal::kVersion,
           "this program speaks version " + std::to_string(kProtocolVersion) + " of the protocol, not " +
               std::to_string(message.version) + "; reload the page");
    return close(client);
  }
  if (client.greeted) return refuse(client, Refusal::kMalformed, "hello was already sent");
  client.greeted = true;
  client.useful = now;
  WelcomeMessage welcome{kProtocolVersion, id, facts_};
  if (cell_) welcome.facts.cell = *cell_;
  send(client, to_json(welcome));
  if (pairing_.known(message.token)) {
    client.token = message.token;
    send(client, to_json(PairedMessage{client.token}));
  }
  send(client, to_json(lease_of(id, client, now)));
  if (cameras_ended_) send(client, to_json(CamerasMessage{*cameras_ended_}));
  if (!study_.empty()) send(client, to_json(StudyMessage{{study_}}));
}

void Hub::handle(std::uint64_t id, Client& client, const PairMessage& message, Time now) {
  if (now < client.next_code) {
    client.code = message.code;
  } else {
    pair(id, client, message.code, now);
  }
}

/// Programs of the same user could read this program's memory, so they need no code. Our browser gets none either.
Result<std::string> Hub::admit(Client& client) {
  if (client.outbox->of_this_user()) return pairing_.admit();
  return Error{"only programs of the user who started steadyhand, on the same machine, pair without a code"};
}

/// A code cannot be guessed in practice; slowing down a connection after many wrong ones only spares the others. No
/// address is locked out: a stranger and the operator may share one machine.
void Hub::pair(std::uint64_t id, Client& client, const std::string& code, Time now) {
  client.useful = now;
  if (client.token.empty()) {
    auto token = code == kLocalCode ? admit(client) : pairing_.redeem(code);
    if (!token) {
      if (++client.wrong_codes >= kFreeCodes) client.next_code = now + kCodeDelay;
      return refuse(client, Refusal::kCode, token.error().message);
    }
    client.token = *std::move(token);
  }
  send(client, to_json(PairedMessage{client.token}));
  send(client, to_json(lease_of(id, client, now)));
}

void Hub::handle(std::uint64_t id, Client& client, const SampleMessage& message, Time now) {
  if (holder_ != id) {
    ++samples_dropped;
    return complain(client, Refusal::kNoLease, "only the client that has control may move the arm", now);
  }
  if (!has_tool(client, message.sample.tool, now)) {
    ++samples_dropped;
    return;
  }
  const Time t = from_seconds(message.t);
  client.clock.arrived(t, now);
  Time hand = client.clock.to_session(t, now);
  std::optional<Client::Newest>& newest = client.newest[message.sample.tool];
  const bool newer = !newest || (message.sequence > newest->sequence && hand >= newest->hand);
  const bool lets_go = !message.sample.clutch;
  const bool late = now - hand > (lets_go ? kOldest / 2 : kOldest);  // later stages drop old ones, too
  if (late && !lets_go) {
    complain(client, Refusal::kLate,
             fmt::format("a sample was {:.1f} s late and was dropped: the network stalls, or t_s uses another clock "
                         "than that of the pings",
                         to_seconds(now - hand)),
             now);
  }
  if (late || !newer) {
    if (!lets_go) {
      ++samples_dropped;
      return;
    }
    hand = now;  // a late release counts from its arrival
  }
  if (!lets_go) last_grip_ = now;
  newest = newest.value_or(Client::Newest{});
  newest->sequence = std::max(newest->sequence, message.sequence);
  newest->hand = std::max(newest->hand, hand);
  OperatorSample sample = message.sample;
  sample.stamp = {hand, now};
  ++samples;
  callbacks_.on_sample(sample);
}

bool Hub::has_tool(Client& client, int tool, Time now) {
  if (tool >= 0 && tool < facts_.tools) return true;
  complain(client, Refusal::kUnknown,
           fmt::format("'tool' is {}; the tools of this robot are 0 to {}", tool, facts_.tools - 1), now);
  return false;
}

/// @param id a client, or one that was sent away and whose socket is not closed yet
void Hub::stop(std::uint64_t id, Time now) {
  const auto found = clients_.find(id);
  if (found != clients_.end()) found->second.useful = found->second.last_message = now;
  tell_stop(id, now);
  const Status done = callbacks_.on_request({});
  if (!done && found != clients_.end()) complain(found->second, Refusal::kUnknown, done.error().message, now);
}

void Hub::handle(std::uint64_t id, Client& client, const RequestMessage& message, Time now) {
  if (holder_ != id && !sets_condition(id, message.request, now)) {
    return refuse(client, Refusal::kNoLease,
                  "only the client that has control may request this; every client may stop the arm");
  }
  const auto& [kind, text, value, object, to, episode, tool] = message.request;
  const auto named = [&text = text](const auto& entry) { return entry.name == text; };
  if (kind == OperatorRequest::Kind::kProfile && std::none_of(facts_.profiles.begin(), facts_.profiles.end(), named)) {
    return refuse(client, Refusal::kUnknown, "no profile has this name");
  }
  if (kind == OperatorRequest::Kind::kPlayback && !text.empty() &&
      std::find(facts_.recordings.begin(), facts_.recordings.end(), text) == facts_.recordings.end()) {
    return refuse(client, Refusal::kUnknown, "no built-in recording has this name");
  }
  if (kind == OperatorRequest::Kind::kWeight && std::none_of(facts_.terms.begin(), facts_.terms.end(), named)) {
    return refuse(client, Refusal::kUnknown, "no term of the objective has this name");
  }
  if (!has_tool(client, tool, now)) return;
  if (const Status done = callbacks_.on_request(message.request); !done) {
    complain(client, Refusal::kUnknown, done.error().message, now);
  }
}

/// Only programs of the same user, which could read this program's memory, may lead a study, one at a time.
void Hub::handle(std::uint64_t id, Client& client, const StudyMessage& message, Time) {
  if (!client.outbox->of_this_user()) {
    return refuse(client, Refusal::kUnpaired,
                  "only a program of the user who started steadyhand, on the same machine, may run a study");
  }
  if (study_leader_ != 0 && study_leader_ != id) {
    return refuse(client, Refusal::kTaken, fmt::format("client {} already runs a study", study_leader_));
  }
  study_leader_ = id;
  tell_study(message.content.text);
}

void Hub::handle(std::uint64_t id, Client& client, const ReplyMessage& message, Time) {
  if (client.token.empty()) return refuse(client, Refusal::kUnpaired, "pair with the code from the terminal first");
  const auto leader = clients_.find(study_leader_);
  if (leader == clients_.end()) return refuse(client, Refusal::kUnknown, "no study is running");
  send(leader->second, to_json(RepliedMessage{id, {message.content.text}}));
}

/// Any paired client may command the arm, and so may its program; a person gives the program its turn.
void Hub::handle(std::uint64_t id, Client& client, const PolicyMessage& message, Time) {
  if (client.token.empty()) return refuse(client, Refusal::kUnpaired, "pair with the code from the terminal first");
  if (!callbacks_.on_policy) return refuse(client, Refusal::kUnknown, "this session takes no policies");
  if (policy_ != 0 && policy_ != id) {
    return refuse(client, Refusal::kTaken, fmt::format("client {} is the policy already", policy_));
  }
  if (const Status done = callbacks_.on_policy(message.policy); !done) {
    return refuse(client, Refusal::kUnknown, done.error().message);
  }
  policy_ = id;
}

void Hub::handle(std::uint64_t id, Client& client, const TargetMessage& message, Time now) {
  if (policy_ != id) {
    return complain(client, Refusal::kNoLease, "only the client that sent 'policy' may send targets", now);
  }
  if (now - from_seconds(message.of) > kOldestObservation) {
    return complain(client, Refusal::kLate,
                    fmt::format("a target was made of a state {:.1f} s ago and was dropped; of_s is now_s of a state",
                                to_seconds(now) - message.of),
                    now);
  }
  if (has_tool(client, message.tool, now)) callbacks_.on_target(message.target());
}

/// Cameras show people, and cost more than states: only for paired clients.
void Hub::handle(std::uint64_t, Client& client, const WatchMessage& message, Time now) {
  using Watch = Client::Watch;
  if (client.token.empty()) return refuse(client, Refusal::kUnpaired, "pair with the code from the terminal first");
  std::vector<Watch> watches(facts_.cameras.size(), Watch::kNot);
  for (const std::string& name : message.cameras) {
    const auto found = std::find_if(facts_.cameras.begin(), facts_.cameras.end(),
                                    [&](const CameraInfo& camera) { return camera.name == name; });
    if (found == facts_.cameras.end()) {
      std::string known;
      for (const CameraInfo& camera : facts_.cameras) known += (known.empty() ? "" : ", ") + camera.name;
      return complain(client, Refusal::kUnknown,
                      known.empty() ? "this session has no cameras" : "no camera has this name; there are " + known,
                      now);
    }
    const auto i = static_cast<std::size_t>(found - facts_.cameras.begin());
    watches[i] = i < client.watches.size() && client.watches[i] == Watch::kAll ? Watch::kAll : Watch::kFromKey;
  }
  client.watches = std::move(watches);
}

void Hub::tell_study(std::string content) {
  const bool over = content == "null";
  for (auto& [id, client] : clients_) {
    if (client.greeted) send(client, to_json(StudyMessage{{content}}));
  }
  if (over) study_leader_ = 0;
  study_ = over ? std::string() : std::move(content);
}

/// Operators must know whether they caused the stop. Not sent for each one: any client may send any number of stops.
void Hub::tell_stop(std::uint64_t id, Time now) {
  constexpr Time kTellEvery = std::chrono::milliseconds(100);
  if (stop_told_ && now - *stop_told_ < kTellEvery) return;
  stop_told_ = now;
  for (auto& [other, client] : clients_) {
    if (client.greeted) send(client, to_json(StoppedMessage{id}));
  }
}

/// During a study, its leader sets the compared condition while no hand controls the arm, and may end a recording that
/// plays.
bool Hub::sets_condition(std::uint64_t id, const OperatorRequest& request, Time now) const {
  using Kind = OperatorRequest::Kind;
  if (study_leader_ == 0 || study_leader_ != id) return false;
  const Kind kind = request.kind;
  if (kind == Kind::kPlayback) return request.text.empty();
  const bool of_a_condition = kind == Kind::kProfile || kind == Kind::kScale || kind == Kind::kLatency ||
                              kind == Kind::kFill || kind == Kind::kRefill || kind == Kind::kTilt;
  return of_a_condition && !led(now);
}

void Hub::handle(std::uint64_t, Client& client, const PingMessage& message, Time now) {
  client.clock.arrived(from_seconds(message.t), now);
  if (message.echo >= 0.0) client.clock.round_trip(now - from_seconds(message.echo) - from_seconds(message.held), now);
  send(client, to_json(PongMessage{message.t, now}));
}

void Hub::refuse(Client& client, Refusal refusal, std::string_view message) {
  ++refused_messages;
  send(client, to_json(ErrorMessage{refusal, message}));
}

/// For errors that every message may cause: sent once a second.
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
