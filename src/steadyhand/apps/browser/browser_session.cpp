#include "steadyhand/apps/browser/browser_session.hpp"

#include "steadyhand/operator/protocol/session_setup.hpp"

namespace steadyhand {

namespace {

constexpr Time kTickPeriod = std::chrono::milliseconds(100);
constexpr Time kStatePeriod = std::chrono::milliseconds(16);
constexpr double kMaxRate = 250.0;  ///< messages a second, of a client
constexpr int kMaxClients = 8;      ///< the page, and observers

}  // namespace

BrowserSession::BrowserSession(BrowserSetup setup, std::function<Time()> wall)
    : setup_(std::move(setup)), clock_(std::move(wall)) {}

Result<std::unique_ptr<BrowserSession>> BrowserSession::make(BrowserSetup setup, std::function<Time()> wall,
                                                             double rate_hz, KeptRecordings::Keep keep) {
  if (setup.profiles.empty()) return Error{"a session needs a profile"};
  LiveSettings settings = operator_defaults();
  settings.planner_rate_hz = rate_hz;
  // The arm waits for a plan, and nothing is late: iterations bound it. Where the system takes the processor from the
  // page for a while, a plan's look-ahead would be over before an iteration was made.
  settings.time_budget = false;
  std::unique_ptr<BrowserSession> made(new BrowserSession(std::move(setup), std::move(wall)));
  BrowserSession& s = *made;
  const BrowserSetup& told = s.setup_;
  settings.cell = told.cell;
  take_profiles(told.profiles, told.profile, settings);
  s.arm_ = std::make_unique<SimulatedArm>(told.robot, told.robot.home, SimulatedArmSettings{}, s.clock_);
  auto session = OneThreadSession::make(told.robot, settings, *s.arm_, s.clock_);
  if (!session) return session.error();
  s.session_ = *std::move(session);
  std::vector<std::string> recordings;
  for (const NamedRecording& recording : told.recordings) recordings.push_back(recording.name);
  s.facts_ = describe_session(told.robot, s.session_->ocp(), settings, told.profiles, std::move(recordings));
  s.operator_interface_ = std::make_unique<OperatorInterface>(
      *s.session_, told.profiles, told.profile, settings.planning.retarget, settings.glass, told.recordings);
  s.callbacks_.now = [&s] { return s.clock_.now(); };
  s.callbacks_.on_sample = [&s](const OperatorSample& sample) { s.operator_interface_->hand(sample); };
  s.callbacks_.on_request = [&s](const OperatorRequest& request) {
    return s.operator_interface_->apply(request, s.clock_.now());
  };
  s.callbacks_.on_lease = [&s](std::uint64_t) { s.operator_interface_->change_hands(); };
  s.callbacks_.on_pairing = [](const std::vector<std::string>&) {};
  s.hub_ = std::make_unique<Hub>(s.facts_, s.callbacks_, kMaxRate, kMaxClients);
  if (Status status = s.hub_->prepare(); !status) return status.error();
  LiveTaps taps;
  if (keep) {
    RecordingSettings recording;
    recording.enabled = false;
    recording.flight_seconds = 0.0;
    s.recorder_.emplace(s.session_->ocp(), recording,
                        describe_run(told.robot, settings, told.profiles, told.profile, s.session_->planner_rate_hz()),
                        s.clock_.now(), std::make_unique<KeptRecordings>(std::move(keep)));
    s.operator_interface_->on_record([&s](bool record) { s.recorder_->ask(record); });
    taps = s.recorder_->taps();
  }
  taps.command = [&s, record = std::move(taps.command)](const JointCommand& command) {
    if (record) record(command);
    if (s.on_command) s.on_command(command);
  };
  s.session_->start(std::move(taps));
  // Something moves until an operator takes control, as in the program.
  if (!told.recordings.empty()) {
    (void)s.operator_interface_->apply({OperatorRequest::Kind::kPlayback, told.recordings.front().name, 0.0},
                                       s.clock_.now());
  }
  return made;
}

std::uint64_t BrowserSession::join(Outbox& outbox, Time now) {
  advance(now);
  return hub_->join(outbox, {"this browser", true}, clock_.now());
}

void BrowserSession::leave(std::uint64_t client, Time now) {
  advance(now);
  hub_->leave(client, clock_.now());
}

void BrowserSession::receive(std::uint64_t client, std::string_view text, Time now) {
  advance(now);
  hub_->receive(client, text, now - *behind_);
}

void BrowserSession::advance(Time now) {
  if (!behind_) behind_ = now - clock_.now();
  Time until = now - *behind_;
  if (until - clock_.now() > kLongestGap) {
    const Time rest = until - clock_.now() - kLongestGap;
    *behind_ += rest;
    left_out_ += rest;
    until = clock_.now() + kLongestGap;
    const bool is_recorded = operator_interface_->controls().playback >= 0;
    if (!is_recorded || rest + kLongestGap > kLongestHiccup) operator_interface_->change_hands();
    ++pauses_;
  }
  while (session_->next_cycle() <= until) {
    (void)operator_interface_->poll(session_->next_cycle());
    session_->step();
    const Time at = clock_.now();
    if (at >= next_tick_) {
      hub_->tick(at);
      next_tick_ = at + kTickPeriod;
    }
    if (at >= next_state_) {
      publish();
      next_state_ += kStatePeriod;
    }
  }
}

void BrowserSession::publish() {
  hub_->broadcast_state({session_->snapshot(), operator_interface_->controls(), recorder_ && recorder_->recording(),
                         std::nullopt, SceneState(), EpisodeView(), operator_interface_->cell(), nullptr});
  if (recorder_) (void)recorder_->take_notices();  // the page sees what is kept
}

}  // namespace steadyhand
