#include "steadyhand/operator/console/live_console.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "steadyhand/core/configuration.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/operator/console/modest_process.hpp"
#include "steadyhand/operator/protocol/session_setup.hpp"
#include "steadyhand/operator/server/terminal_qr.hpp"
#include "steadyhand/session/live/realtime_threads.hpp"

namespace steadyhand {

namespace {

constexpr Time kPublishPeriod = std::chrono::milliseconds(16);
constexpr Time kCamerasPeriod = std::chrono::milliseconds(500);  ///< between two looks at whether they have ended

/// Opens it if there is a desktop; a failure does not concern the session. Every user of this machine can read the
/// address among the arguments of the programs that open it.
void open_browser(const std::string& url) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  launch({"xdg-open", {url}});
}

/// The edit of a recorded session that a request asks for; none: the request is for this session.
std::optional<SessionEdit> session_edit(const OperatorRequest& request) {
  switch (request.kind) {
    case OperatorRequest::Kind::kLabel:
      return SessionEdit{SessionEdit::Kind::kLabel, request.text, request.to};
    case OperatorRequest::Kind::kRename:
      return SessionEdit{SessionEdit::Kind::kRename, request.text, request.to};
    case OperatorRequest::Kind::kDelete:
      return SessionEdit{SessionEdit::Kind::kDelete, request.text, {}};
    default:
      return std::nullopt;
  }
}

}  // namespace

Result<std::unique_ptr<LiveConsole>> LiveConsole::make(const RobotModel& model, ConsoleSettings settings, Arm& arm,
                                                       Clock& clock, ConsoleCallbacks callbacks) {
  if (settings.profile < 0 || settings.profile >= std::ssize(settings.profiles)) {
    return Error{fmt::format("profile {} of {}: there is none", settings.profile, settings.profiles.size())};
  }
  if (!settings.solver.empty()) {
    for (Profile& profile : settings.profiles) profile.solver = settings.solver;
  }
  take_profiles(settings.profiles, settings.profile, settings.live);
  auto session = LiveSession::make(model, settings.live, arm, clock);
  if (!session) return session.error();
  return std::unique_ptr<LiveConsole>(
      new LiveConsole(model, std::move(settings), clock, std::move(callbacks), *std::move(session)));
}

LiveConsole::LiveConsole(const RobotModel& model, ConsoleSettings settings, Clock& clock, ConsoleCallbacks callbacks,
                         std::unique_ptr<LiveSession> session)
    : model_(&model),
      settings_(std::move(settings)),
      clock_(&clock),
      callbacks_(std::move(callbacks)),
      session_(std::move(session)) {
  for (const NamedRecording& recording : settings_.recordings) recordings_.push_back(recording.name);
  operator_interface_ = std::make_unique<OperatorInterface>(*session_, settings_.profiles, settings_.profile,
                                                            settings_.live.planning.retarget, settings_.live.glass,
                                                            std::exchange(settings_.recordings, {}));
  if (settings_.scene != nullptr && settings_.task != nullptr) {
    judge_.emplace(*settings_.task, true);
    things_.emplace(settings_.things);
  }
}

LiveConsole::~LiveConsole() {
  close_page();
  if (settings_.cameras != nullptr) settings_.cameras->end();
  // Its threads end before the objects that they use.
  if (session_->is_running()) (void)session_->finish();
}

/// The session's description in its recording.
SessionRecorder::Metadata LiveConsole::describe() const {
  SessionRecorder::Metadata all = settings_.metadata;
  for (auto& [name, entries] :
       describe_run(*model_, settings_.live, settings_.profiles, settings_.profile, session_->planner_rate_hz())) {
    all[name].merge(entries);
  }
  return all;
}

void LiveConsole::say_addresses(const std::vector<std::string>& urls) const {
  for (const std::string& url : urls) say("open  " + url + "\n");
}

/// For a phone, which reaches this machine over the network only.
void LiveConsole::draw(const std::string& url) const {
  if (settings_.server.lan && callbacks_.draw) callbacks_.draw(terminal_qr(url));
}

void LiveConsole::say_notices() {
  for (const std::string& line : session_->warnings(warned_)) {
    say("note: " + line + "\n");
    ++warned_;
  }
  for (const std::string& line : recorder_->take_notices()) say(line + "\n");
  for (const EpisodeOutcome& outcome : recorder_->take_episode_outcomes()) settle(outcome);
}

void LiveConsole::settle(const EpisodeOutcome& outcome) {
  if (episodes_.settle(outcome, clock_->now())) {
    say(fmt::format("episode {} is lost: its recording ended before it was kept\n", outcome.episode));
  } else if (!outcome.recorded && outcome.kind != EpisodeMark::Kind::kBegin) {
    say(fmt::format("'{}' of episode {} is not recorded: its recording has ended\n", to_string(outcome.kind),
                    outcome.episode));
  }
}

/// During an episode neither the scene nor the recording changes.
Status LiveConsole::check_between_episodes() const {
  const EpisodeView now = episode();
  if (!now.running) return Done{};
  return Error{fmt::format("episode {} is running; keep or discard it first", now.number)};
}

Status LiveConsole::open_page() {
  const std::filesystem::path& folder = settings_.recording_place.path;
  library_.emplace(folder.empty() ? default_session_folder() : folder, settings_.report_program);
  ServerCallbacks callbacks;
  callbacks.now = [this] { return clock_->now(); };
  callbacks.on_thread = [realtime = settings_.live.realtime] {
    name_thread("server");
    if (realtime) (void)make_realtime(kServerPriority);  // if it is not permitted the session has reported it
  };
  callbacks.on_tick = [this] { operator_interface_->note_server_alive(clock_->now()); };
  callbacks.on_failure = [this](const std::string& what) {
    session_->fail("the page's server failed: restart the program", what.c_str());
  };
  callbacks.on_sample = [this](const OperatorSample& sample) { operator_interface_->hand(sample); };
  callbacks.on_request = [this](const OperatorRequest& request) {
    Status done = apply(request);
    if (!done) say("refused: " + done.error().message + "\n");
    return done;
  };
  callbacks.on_policy = [this](std::optional<PolicyInfo> policy) {
    say(policy ? "policy '" + policy->name + "' is connected\n" : "the policy has gone\n");
    return operator_interface_->connect(std::move(policy));
  };
  callbacks.on_target = [this](const PolicyTarget& target) { operator_interface_->target(target, clock_->now()); };
  callbacks.on_lease = [this](std::uint64_t client) {
    if (callbacks_.on_lease) callbacks_.on_lease(client);
    operator_interface_->change_hands();
  };
  callbacks.on_pairing = [this](const std::vector<std::string>& urls) {
    say_addresses(urls);
    draw(urls.back());
  };
  callbacks.on_fetch = [this](const std::string& path, SessionLibrary::Answer answer) {
    library_->fetch(path, std::move(answer));
  };
  ServerFacts facts = describe_session(*model_, session_->ocp(), settings_.live, settings_.profiles, recordings_);
  if (const Task* task = settings_.task) {
    facts.task = {task->name, task->instruction, task->time_limit, {}, task->things};
    for (const Condition& condition : task->success) facts.task->conditions.push_back(condition.text);
  }
  if (settings_.cameras != nullptr) facts.cameras = settings_.cameras->cameras();
  auto server = Server::start(settings_.server, std::move(facts), std::move(callbacks));
  if (!server) return server.error();
  server_ = *std::move(server);
  say_addresses(server_->urls());
  if (settings_.server.lan) {
    say("certificate's SHA-256 fingerprint: " + server_->fingerprint() + "\n");
    draw(server_->urls().back());
  }
  if (settings_.browser) open_browser(server_->local_url());
  return Done{};
}

Status LiveConsole::start() {
  if (settings_.page) {
    if (Status s = open_page(); !s) return s;
  }
  // Last, after everything that may fail: a session that did not start leaves no recording.
  recorder_.emplace(session_->ocp(), settings_.recording, describe(), clock_->now(),
                    std::make_unique<RecordingFolder>(settings_.recording_place),
                    settings_.cameras != nullptr ? settings_.cameras->cameras() : std::vector<CameraInfo>());
  operator_interface_->on_record([this](bool record) { recorder_->ask(record); });
  session_->start(recorder_->taps());
  if (settings_.cameras != nullptr) {
    settings_.cameras->start([this, show = server_ ? server_->pictures() : nullptr](VideoPacket packet) {
      if (show) show(packet);
      recorder_->film(std::move(packet));
    });
  }
  started_ = true;
  return Done{};
}

/// On the server's thread.
Status LiveConsole::apply(const OperatorRequest& request) {
  if (const std::optional<SessionEdit> edit = session_edit(request)) return edit_session(*edit);
  if (request.kind == OperatorRequest::Kind::kEpisode) return mark_episode(request.episode);
  if (request.kind == OperatorRequest::Kind::kSetUp) return set_up_scene(request.value);
  if (request.kind == OperatorRequest::Kind::kRecord && request.value == 0.0) {
    if (Status s = check_between_episodes(); !s) return s;
  }
  return operator_interface_->apply(request, clock_->now());
}

/// @param seed negative: the next
Status LiveConsole::set_up_scene(double seed) {
  if (settings_.scene == nullptr) return Error{"there is no scene to set up; --arm mujoco --task has one"};
  if (Status s = check_between_episodes(); !s) return s;
  const Lock lock(scene_);
  seed_ = seed < 0.0 ? seed_ + 1 : static_cast<std::uint64_t>(seed);
  return settings_.scene->set_up(seed_);
}

Status LiveConsole::mark_episode(EpisodeMark mark) {
  if (!started_) return Error{"the session has not started"};
  if (mark.kind == EpisodeMark::Kind::kBegin && !(recorder_->recording() && recorder_->wanted())) {
    return Error{"the session is not recorded, so no episode could be kept; record it first"};
  }
  mark.at = clock_->now();
  if (mark.kind == EpisodeMark::Kind::kBegin && mark.task.empty() && settings_.task != nullptr) {
    mark.task = settings_.task->instruction;
  }
  std::optional<bool> decided;
  {
    const Lock lock(scene_);
    if (mark.kind == EpisodeMark::Kind::kBegin) decided_.reset();
    decided = decided_;
  }
  const bool begins = mark.kind == EpisodeMark::Kind::kBegin;
  const Result<EpisodeMark> made = episodes_.take(std::move(mark), decided);
  if (!made) return made.error();
  if (const Status marked = recorder_->mark(*made); !marked) {
    settle({made->episode, made->kind, false});
    return marked;
  }
  if (begins) episode_begins_ = true;
  return Done{};
}

void LiveConsole::look_at_cameras(Time now) {
  if (settings_.cameras == nullptr || now - cameras_seen_ < kCamerasPeriod) return;
  cameras_seen_ = now;
  std::vector<std::string> ended;
  for (CameraState& state : settings_.cameras->states()) ended.push_back(std::move(state.ended));
  if (cameras_ended_ && *cameras_ended_ == ended) return;
  cameras_ended_ = std::make_shared<const std::vector<std::string>>(std::move(ended));
}

/// Passes the scene's newest state to its task and the recording.
void LiveConsole::look_at_scene(const SessionSnapshot& snapshot) {
  SceneState scene;
  if (!settings_.scene->read_scene(scene)) return;
  seen_ = scene;
  const bool leads = snapshot.state == SupervisionState::kEngaged;
  if (episode_begins_.exchange(false) || (leads && !judge_->has_begun())) judge_->begin();
  const TaskProgress& progress = judge_->update(scene, spilled_share(snapshot));
  {
    const Lock lock(scene_);
    decided_ = progress.success;
  }
  recorder_->see({scene, progress});
  const bool first = !things_->known();
  if (const Status done = things_->follow(scene, *session_); !done && first) {
    say("note: the scene's things are not drawn: " + done.error().message + "\n");
  }
}

/// On the server's thread; errors of the disk are reported later.
Status LiveConsole::edit_session(const SessionEdit& edit) {
  if (!started_) return Error{"the session has not started"};
  return library_->edit(edit, recorder_->writing(), [this](const Status& done) {
    if (!done) say(done.error().message + "\n");
  });
}

Time LiveConsole::poll(Time now) {
  const Time due = std::min(now + kPollPeriod, operator_interface_->poll(now));
  say_notices();
  if (now - shown_ >= kPublishPeriod && (server_ || judge_)) {
    shown_ = now;
    const SessionSnapshot snapshot = session_->snapshot();
    if (judge_) look_at_scene(snapshot);
    const std::optional<TaskProgress> progress = judge_ ? std::optional(judge_->progress()) : std::nullopt;
    if (server_) {
      look_at_cameras(now);
      server_->publish({snapshot, operator_interface_->controls(), recorder_->recording(), progress, seen_,
                        episodes_.view(now), operator_interface_->cell(), cameras_ended_});
    }
  }
  return due;
}

LiveSummary LiveConsole::finish() {
  close_page();
  if (settings_.cameras != nullptr) settings_.cameras->end();
  const LiveSummary summary = session_->finish();
  recorder_->finish(summary);
  return summary;
}

}  // namespace steadyhand
