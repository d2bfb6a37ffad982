#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/profile_file.hpp"
#include "session/live_session.hpp"
#include "session/playback.hpp"

namespace steadyhand {

/// A recorded hand that the operator may let play.
struct NamedRecording {
  std::string name;
  Recording recording;
};

/// Carries out what operators ask of a live session beside moving it, and lets recorded hands play. Its calls come from
/// any thread; none waits for more than another call.
class OperatorDesk {
 public:
  /// The session must outlive it. @param profile index of the profile that the session began with
  OperatorDesk(LiveSession& session, std::vector<Profile> profiles, int profile, const RetargetSettings& retarget,
               std::vector<NamedRecording> recordings);

  /// Who begins and ends recordings when the operator asks for it. Before the first request.
  void on_record(std::function<void(bool)> call) { on_record_ = std::move(call); }
  /// Done, or why the request cannot be obeyed; then nothing changes.
  Status apply(const OperatorRequest& request, Time now);
  /// The operator's own hand. Gripping ends a recording that plays; the next grip moves the arm.
  void hand(const OperatorSample& sample);
  /// Another hand from here on: the arm disengages.
  void change_hands();
  /// Feeds what the recording that plays has for this time. Call every few milliseconds, and when the next sample is
  /// due.
  /// @return when that is; Time::max() if nothing plays
  Time poll(Time now);

  SessionControls controls() const;

 private:
  Status set_profile(const std::string& name);
  Status set_weight(const std::string& name, double value);
  Status play(const std::string& name, Time now);
  void end_playback();
  void send();

  mutable std::mutex mutex_;
  LiveSession* session_;
  std::vector<Profile> profiles_;
  std::vector<NamedRecording> recordings_;
  std::vector<JointVector> weights_;  ///< by index of Ocp::objectives()
  SessionControls controls_;
  std::optional<Playback> playback_;
  std::function<void(bool)> on_record_;
};

}  // namespace steadyhand
