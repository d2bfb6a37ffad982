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

/// Carries out what operators ask of a live session beside moving it, and lets recorded hands play and a policy lead.
/// Its calls come from any thread; none waits for more than another call.
///
/// A recorded hand has no fingers that let go, so somebody must stand for it: it ends when the hands change (the lease
/// of who began it ends, or, begun at the terminal, somebody takes the first lease), when the arm is halted, and when
/// the server falls silent, through which a stop would come. Only a request begins it again. It leads the tool to where
/// that was when the session began, and moves from there: elsewhere its motion might be out of reach.
///
/// A policy has its turn from a person's request on, under the same conditions. Within it a person who grips leads the
/// arm from where it is, and once that hand lets go the policy goes on; both begin by a grip of their own, so that
/// nothing steps. A hand that was closed before the turn began has to open first.
class OperatorInterface {
 public:
  /// The session must outlive it. @param profile index of the profile that the session began with
  OperatorInterface(Session& session, std::vector<Profile> profiles, int profile, const RetargetSettings& retarget,
                    const GlassSettings& glass, std::vector<NamedRecording> recordings);

  /// Who begins and ends recordings when the operator asks for it; until then that is refused.
  void on_record(std::function<void(bool)> call);
  /// Done, or why the request cannot be obeyed; then nothing changes.
  Status apply(const OperatorRequest& request, Time now);
  /// The operator's own hand. Gripping ends a recording that plays; the next grip moves the arm. In a policy's turn a
  /// grip leads at once.
  void hand(const OperatorSample& sample);
  /// Another hand from here on: the arm disengages, a recording that plays ends, and so does a policy's turn.
  void change_hands();
  /// A policy is there from now on, or (none) it has gone, with its turn. Fails on a period out of range.
  Status connect(std::optional<PolicyInfo> policy);
  /// Where that wants the tool.
  void target(const PolicyTarget& target, Time now);
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
  std::optional<Pose> tool(Time now) const;
  std::vector<Pose> way_home(const Recording& recording, Time now) const;
  void end_playback();
  void watch_playback(Time now);
  Status give_turn(bool turn, Time now);
  void end_turn();
  void hand_in_turn(const OperatorSample& sample);
  void send();

  mutable Mutex mutex_;
  Session* session_;
  std::vector<Profile> profiles_;
  std::vector<int> planners_;  ///< of each, as OperatorSettings::planner
  RetargetSettings retarget_;  ///< at first: controls_ has scale and yaw
  GlassSettings glass_;
  std::vector<NamedRecording> recordings_;
  std::vector<JointVector> weights_;          ///< by index of Ocp::objectives()
  std::vector<JointVector> profile_weights_;  ///< the same as the profile has them
  SessionControls controls_;
  std::shared_ptr<const std::string> cell_json_;
  std::uint64_t cell_version_ = 0;  ///< Session::CellSet::version that it is of
  std::optional<Playback> playback_;
  std::optional<Pose> X_base_home_;  ///< of the tool, when the session began
  Time watched_{0};
  std::uint64_t halts_ = 0;  ///< Session::halts when it or the policy's turn began
  std::optional<PolicyHand> policy_;
  std::optional<Time> gripped_;  ///< when the operator's hand was closed last
  bool may_take_over_ = false;   ///< in the policy's turn the operator's hand was open
  bool takes_over_ = false;      ///< and leads now
  std::optional<Time> server_alive_;
  std::function<void(bool)> on_record_;
};

}  // namespace steadyhand
