#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/config/profile.hpp"
#include "steadyhand/desk/operator.hpp"
#include "steadyhand/desk/playback.hpp"
#include "steadyhand/live/session.hpp"

namespace steadyhand {

/// A recorded hand that the operator may let play.
struct NamedRecording {
  std::string name;
  Recording recording;
};

/// Carries out what operators ask of a live session beside moving it, and lets recorded hands play. Its calls come from
/// any thread; none waits for more than another call.
///
/// A recorded hand has no fingers that let go, so somebody must stand for it: it ends when the hands change (the lease
/// of who began it ends, or, begun at the terminal, somebody takes the first lease), when the arm is halted, and when
/// the server falls silent, through which a stop would come. Only a request begins it again.
class OperatorInterface {
 public:
  /// The session must outlive it. @param profile index of the profile that the session began with
  OperatorInterface(Session& session, std::vector<Profile> profiles, int profile, const RetargetSettings& retarget,
                    const GlassSettings& glass, std::vector<NamedRecording> recordings);

  /// Who begins and ends recordings when the operator asks for it; until then that is refused.
  void on_record(std::function<void(bool)> call);
  /// Done, or why the request cannot be obeyed; then nothing changes.
  Status apply(const OperatorRequest& request, Time now);
  /// The operator's own hand. Gripping ends a recording that plays; the next grip moves the arm.
  void hand(const OperatorSample& sample);
  /// Another hand from here on: the arm disengages, and a recording that plays ends.
  void change_hands();
  /// The server's thread lives. Several times a second, from the first call on.
  void note_server_alive(Time now);
  /// Feeds what the recording that plays has for this time. Call every few milliseconds, and when the next sample is
  /// due.
  /// @return when that is; Time::max() if nothing plays
  Time poll(Time now);

  SessionControls controls() const;
  /// What stands around the arm, as JSON; null until somebody has changed it. Another pointer is another cell.
  std::shared_ptr<const std::string> cell();

 private:
  Status set_profile(const std::string& name);
  bool spares_liquid(int profile, double tilt) const;
  Status set_object(const OperatorRequest& request, Time now);
  Status set_weight(const std::string& name, double value);
  Status play(const std::string& name, Time now);
  void end_playback();
  void send();

  mutable Mutex mutex_;
  Session* session_;
  std::vector<Profile> profiles_;
  GlassSettings glass_;
  std::vector<NamedRecording> recordings_;
  std::vector<JointVector> weights_;  ///< by index of Ocp::objectives()
  SessionControls controls_;
  std::shared_ptr<const std::string> cell_json_;
  std::uint64_t cell_version_ = 0;  ///< Session::CellSet::version that it is of
  std::optional<Playback> playback_;
  std::uint64_t halts_ = 0;  ///< Session::halts when it began
  std::optional<Time> server_alive_;
  std::function<void(bool)> on_record_;
};

}  // namespace steadyhand
