#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/operator/protocol/operator.hpp"
#include "steadyhand/operator/protocol/playback.hpp"
#include "steadyhand/operator/protocol/policy_hand.hpp"
#include "steadyhand/planning/pipeline/profile.hpp"
#include "steadyhand/session/live/live_session.hpp"

namespace steadyhand {

/// A recorded hand that the operator may let play.
struct NamedRecording {
  std::string name;
  Recording recording;
};

/// Carries out the operators' requests to a live session other than moving it, plays recorded hands, and gives a policy
/// its turn. Its calls come from any thread; none waits for more than another call.
///
/// A recorded hand cannot release by itself, so an operator must be responsible for it. It ends when the hands change:
/// the client that started it loses control or, if it was started at the terminal, a client takes control. It also ends
/// when the arm is halted, and when the server times out, through which a stop would come. Only a request starts it
/// again. It first moves its tools to where they were when the session began: elsewhere the recorded motion might be
/// out of reach. Tools that it has no samples of do not move.
///
/// A policy's turn starts with a person's request, under the same conditions. During the turn a person who engages any
/// tool controls the arm from where it is, and the policy waits with all tools; it continues once no hand of that
/// person is closed. Both engage again first, so that nothing steps. A hand that was closed before the turn began has
/// to open first.
class OperatorInterface {
 public:
  /// The session must outlive it. @param profile index of the session's first profile
  OperatorInterface(Session& session, std::vector<Profile> profiles, int profile, const RetargetSettings& retarget,
                    const GlassSettings& glass, std::vector<NamedRecording> recordings);

  /// Starts and ends recordings when the operator asks for it; without it such requests are refused.
  void on_record(std::function<void(bool)> call);
  /// Done, or why the request cannot be obeyed; then nothing changes.
  Status apply(const OperatorRequest& request, Time now);
  /// A hand of the operator, for a tool that the robot has. Engaging ends a recording that plays; the next clutch press
  /// moves the arm. In a policy's turn the press moves it at once.
  void hand(const OperatorSample& sample);
  /// The hands change: the arm disengages, and a recording that plays or a policy's turn ends.
  void change_hands();
  /// A policy has connected, or (none) disconnected, which ends its turn. Fails on a period out of range.
  Status connect(std::optional<PolicyInfo> policy);
  /// The policy's target for a tool. Ignored if the robot has no such tool.
  void target(const PolicyTarget& target, Time now);
  /// The server's thread is alive. Several times a second, from the first call on.
  void note_server_alive(Time now);
  /// Feeds what the recording that plays has for this time. Call every few milliseconds, and when the next sample is
  /// due.
  /// @return when that is; Time::max() if nothing plays
  Time poll(Time now);

  SessionControls controls() const;
  /// The obstacles as JSON; null until they have changed. A new pointer means that they changed again.
  std::shared_ptr<const std::string> cell();

 private:
  Status set_profile(const std::string& name);
  bool spares_liquid(int profile, double tilt) const;
  Status set_object(const OperatorRequest& request, Time now);
  Status set_weight(const std::string& name, double value);
  Status play(const std::string& name, Time now);
  std::optional<PerTool<Pose>> tools(Time now) const;
  PerTool<std::vector<Pose>> ways_home(const Recording& recording, Time now) const;
  void end_playback();
  void watch_playback(Time now);
  Status give_turn(bool turn, Time now);
  void end_turn();
  void hand_in_turn(const OperatorSample& sample);
  bool takes_over() const;
  void send();

  mutable Mutex mutex_;
  Session* session_;
  std::vector<Profile> profiles_;
  std::vector<int> planners_;  ///< for each profile OperatorSettings::planner
  RetargetSettings retarget_;  ///< at first: controls_ has scale and yaw
  GlassSettings glass_;
  std::vector<NamedRecording> recordings_;
  std::vector<JointVector> weights_;          ///< by index of Ocp::objectives()
  std::vector<JointVector> profile_weights_;  ///< the same, from the profile
  SessionControls controls_;
  std::shared_ptr<const std::string> cell_json_;
  std::uint64_t cell_version_ = 0;  ///< Session::CellSet::version of cell_json_
  std::optional<Playback> playback_;
  std::optional<PerTool<Pose>> X_base_home_;  ///< of the tools when the session began
  Time watched_{0};
  std::uint64_t halts_ = 0;         ///< Session::halts when it or the policy's turn began
  std::vector<PolicyHand> policy_;  ///< for each tool; empty: none is connected
  /// A hand of the operator.
  struct Hand {
    std::optional<Time> gripped;  ///< when it was closed last
    bool may_take_over = false;   ///< in the policy's turn it was open
    bool takes_over = false;      ///< it controls the arm now
  };
  PerTool<Hand> hands_;
  std::optional<Time> server_alive_;
  std::function<void(bool)> on_record_;
};

}  // namespace steadyhand
