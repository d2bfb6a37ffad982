#include "steadyhand/console/live_console.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "steadyhand/console/modest_process.hpp"
#include "steadyhand/core/configuration.hpp"
#include "steadyhand/desk/session_setup.hpp"
#include "steadyhand/live/realtime.hpp"
#include "steadyhand/record/cell_json.hpp"
#include "steadyhand/record/robot_json.hpp"
#include "steadyhand/serve/terminal_qr.hpp"

namespace steadyhand {

namespace {

constexpr Time kPublishPeriod = std::chrono::milliseconds(16);

/// Where there is a desktop; whether it works is no concern of the session. Every user of this machine can read the
/// address among the arguments of the programs that open it.
void open_browser(const std::string& url) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  launch({"xdg-open", {url}});
}

/// What a request would have done with a recorded session; none: it is of this session.
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
  take_profiles(settings.profiles, settings.profile, settings.live);
  if (!settings.solver.empty()) settings.live.planning.planner.solver = settings.solver;
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
}

LiveConsole::~LiveConsole() {
  close_page();
  // Its threads end before what they use goes.
  if (session_->is_running()) (void)session_->finish();
}

/// What the recording tells of its session.
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

void LiveConsole::say_notices() {
  for (const std::string& line : recorder_->take_notices()) say(line + "\n");
}

Status LiveConsole::open_page() {
  const std::filesystem::path& folder = settings_.recording_place.path;
  library_.emplace(folder.empty() ? default_session_folder() : folder, settings_.report_program);
  ServerCallbacks callbacks;
  callbacks.now = [this] { return clock_->now(); };
  callbacks.on_thread = [realtime = settings_.live.realtime] {
    name_thread("server");
    if (realtime) (void)make_realtime(kServerPriority);  // if it is not permitted the session has said so
  };
  callbacks.on_tick = [this] { operator_interface_->note_server_alive(clock_->now()); };
  callbacks.on_failure = [this](const std::string& what) {
    session_->fail("the page's server failed: restart the program", what.c_str());
  };
  callbacks.on_sample = [this](const OperatorSample& sample) { operator_interface_->hand(sample); };
  callbacks.on_request = [this](const OperatorRequest& request) {
    const std::optional<SessionEdit> edit = session_edit(request);
    Status done = edit ? edit_session(*edit) : operator_interface_->apply(request, clock_->now());
    if (!done) say("refused: " + done.error().message + "\n");
    return done;
  };
  callbacks.on_lease = [this](std::uint64_t client) {
    if (callbacks_.on_lease) callbacks_.on_lease(client);
    operator_interface_->change_hands();
  };
  callbacks.on_pairing = [this](const std::vector<std::string>& urls) {
    say_addresses(urls);
    if (settings_.server.lan) say(terminal_qr(urls.back()));
  };
  callbacks.on_fetch = [this](const std::string& path, SessionLibrary::Answer answer) {
    library_->fetch(path, std::move(answer));
  };
  auto server = Server::start(
      settings_.server, describe_session(*model_, session_->ocp(), settings_.live, settings_.profiles, recordings_),
      std::move(callbacks));
  if (!server) return server.error();
  server_ = *std::move(server);
  say_addresses(server_->urls());
  if (settings_.server.lan) {
    const std::string url = server_->urls().back();
    say("certificate's SHA-256 fingerprint: " + server_->fingerprint() + "\n" + terminal_qr(url));
  }
  if (settings_.browser) open_browser(server_->local_url());
  return Done{};
}

Status LiveConsole::start() {
  if (settings_.page) {
    if (Status s = open_page(); !s) return s;
  }
  // What may fail has not: no recording is left of a session that never was.
  recorder_.emplace(session_->ocp(), settings_.recording, describe(), clock_->now(),
                    std::make_unique<RecordingFolder>(settings_.recording_place));
  operator_interface_->on_record([this](bool record) { recorder_->ask(record); });
  session_->start(recorder_->taps());
  started_ = true;
  return Done{};
}

/// On the server's thread; what the disk says comes later.
Status LiveConsole::edit_session(const SessionEdit& edit) {
  if (!started_) return Error{"the session has not begun"};
  return library_->edit(edit, recorder_->writing(), [this](const Status& done) {
    if (!done) say(done.error().message + "\n");
  });
}

Time LiveConsole::poll(Time now) {
  const Time due = std::min(now + kPollPeriod, operator_interface_->poll(now));
  say_notices();
  if (server_ && now - shown_ >= kPublishPeriod) {
    shown_ = now;
    server_->publish(
        {session_->snapshot(), operator_interface_->controls(), recorder_->recording(), operator_interface_->cell()});
  }
  return due;
}

LiveSummary LiveConsole::finish() {
  close_page();
  const LiveSummary summary = session_->finish();
  recorder_->finish(summary);
  return summary;
}

}  // namespace steadyhand
