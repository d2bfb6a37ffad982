#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/video.hpp"
#include "steadyhand/files/archive/recording_folder.hpp"
#include "steadyhand/files/archive/session_recorder.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/operator/console/session_library.hpp"
#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/operator/protocol/scene_things.hpp"
#include "steadyhand/operator/server/server.hpp"
#include "steadyhand/session/live/live_session.hpp"
#include "steadyhand/session/task/scene.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

struct ConsoleSettings {
  LiveSettings live;  ///< its problem, solver and tolerance become those of the profile
  ServerSettings server;
  RecordingSettings recording;
  RecordingFolderSettings recording_place;
  std::vector<Profile> profiles;                   ///< to choose among, at least one
  int profile = 0;                                 ///< index of the first
  std::string solver;                              ///< empty: the profile's
  std::vector<NamedRecording> recordings;          ///< hands that may play
  SessionRecorder::Metadata metadata;              ///< for the recording: tables, and entries of `robot` and `run`
  bool page = true;                                ///< serve the operator's page
  bool browser = false;                            ///< open it
  const Task* task = nullptr;                      ///< the scene's; null: none. Task and scene must outlive the console
  SimulatedScene* scene = nullptr;                 ///< null: there is none
  std::vector<std::pair<int, CellObject>> things;  ///< Task::things that the page draws, and solids in their frame
  Cameras* cameras = nullptr;                      ///< null: none. Not started yet; must outlive the console
  std::filesystem::path report_program;            ///< answers what the page asks of recordings, see SessionLibrary
};

/// Callbacks of a console. Any may be empty.
struct ConsoleCallbacks {
  /// Lines for users, from any thread; must not block.
  std::function<void(std::string text)> say;
  /// The same with escape sequences of a terminal: a code for a phone's camera.
  std::function<void(std::string picture)> draw;
  /// Another client of the page has control; 0: none has. On the server's thread; must not block.
  std::function<void(std::uint64_t client)> on_lease;
};

/// A live session connected to what its operator needs: the operator interface that carries out requests, recorded
/// hands, the page with its server, past sessions, the recording. One thread makes it, calls poll() every millisecond,
/// and finishes it.
/// millisecond, and finishes it.
///
///     auto console = LiveConsole::make(model, settings, arm, clock);
///     (*console)->start();
///     while (!done) sleep_until((*console)->poll(clock.now()));
///     LiveSummary summary = (*console)->finish();
class LiveConsole {
 public:
  static constexpr Time kPollPeriod = std::chrono::milliseconds(1);

  /// Model, arm and clock must outlive it. Fails as LiveSession::make, and on weights that are none of the problem's.
  static Result<std::unique_ptr<LiveConsole>> make(const RobotModel& model, ConsoleSettings settings, Arm& arm,
                                                   Clock& clock, ConsoleCallbacks callbacks = {});
  /// Ends what finish() has not.
  ~LiveConsole();

  /// Serves the page, starts the recording and the threads. Call once. Fails as Server::start; then nothing was
  /// started.
  Status start();
  /// Plays recorded hands, shows the session at the page, reports notices.
  /// @return when to call again: in a millisecond at most
  Time poll(Time now);
  /// Closes the page; then no callback of its server runs. finish() does it too.
  void close_page() { server_.reset(); }
  /// Stops the arm, ends threads and recording.
  LiveSummary finish();
  /// Reports the notices of session and recording that are not reported yet; poll() does it too.
  void say_notices();
  /// Carries out what a client asks for, as the server does on its thread.
  Status apply(const OperatorRequest& request);

  LiveSession& session() { return *session_; }
  OperatorInterface& operator_interface() { return *operator_interface_; }
  const Server* server() const { return server_.get(); }                 ///< null without a page
  EpisodeView episode() const { return episodes_.view(clock_->now()); }  ///< the current or newest episode
  const Profile& profile() const { return settings_.profiles[settings_.profile]; }

 private:
  LiveConsole(const RobotModel& model, ConsoleSettings settings, Clock& clock, ConsoleCallbacks callbacks,
              std::unique_ptr<LiveSession> session);
  SessionRecorder::Metadata describe() const;
  Status open_page();
  Status edit_session(const SessionEdit& edit);
  Status set_up_scene(double seed);
  Status mark_episode(EpisodeMark mark);
  Status check_between_episodes() const;
  void settle(const EpisodeOutcome& outcome);
  void look_at_cameras(Time now);
  void look_at_scene(const SessionSnapshot& snapshot);
  void say(const std::string& text) const {
    if (callbacks_.say) callbacks_.say(text);
  }
  void draw(const std::string& url) const;
  void say_addresses(const std::vector<std::string>& urls) const;

  const RobotModel* model_;
  ConsoleSettings settings_;  ///< except the recordings, which are the operator_interface's
  Clock* clock_;
  ConsoleCallbacks callbacks_;
  std::unique_ptr<LiveSession> session_;
  std::vector<std::string> recordings_;  ///< their names
  std::unique_ptr<OperatorInterface> operator_interface_;
  std::optional<SessionLibrary> library_;
  std::optional<SessionRecorder> recorder_;
  Episodes episodes_;
  std::optional<TaskJudge> judge_;
  std::atomic<bool> episode_begins_{false};                        ///< the judge does not know of it yet
  std::optional<SceneThings> things_;                              ///< ConsoleSettings::things
  SceneState seen_;                                                ///< newest look at the scene
  std::shared_ptr<const std::vector<std::string>> cameras_ended_;  ///< as OperatorView has it
  Time cameras_seen_{0};
  Mutex scene_;                  ///< guards the next two
  std::optional<bool> decided_;  ///< how the scene's task ended
  std::uint64_t seed_ = 0;       ///< seed of the places in the scene
  std::unique_ptr<Server> server_;
  std::atomic<bool> started_{false};
  std::size_t warned_ = 0;  ///< number of the session's warnings that were reported
  Time shown_{0};
};

}  // namespace steadyhand
