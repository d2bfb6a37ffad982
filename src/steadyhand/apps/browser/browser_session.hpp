#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "steadyhand/apps/browser/kept_recordings.hpp"
#include "steadyhand/apps/browser/setup_json.hpp"
#include "steadyhand/arms/driver/simulated_arm.hpp"
#include "steadyhand/files/archive/session_recorder.hpp"
#include "steadyhand/operator/protocol/hub.hpp"
#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/session/live/one_thread_session.hpp"

namespace steadyhand {

/// A session with a simulated arm and its operators, on one thread and without sockets, as a page's Worker runs it.
/// Its clock follows its caller's, and makes up for up to kLongestGap at once. The rest of a longer pause (a frozen
/// tab, a sleeping machine) is left out: the clock stops, and the operator must engage again. A recorded hand continues
/// after a hiccup, as it stopped, too.
class BrowserSession {
 public:
  static constexpr Time kLongestGap = std::chrono::milliseconds(250);
  /// Less than a second: timers of a hidden tab fire once a second, and nothing shall move there.
  static constexpr Time kLongestHiccup = std::chrono::milliseconds(900);

  /// Fails as LiveSession::make.
  /// @param wall what planning is timed with; empty: nothing is, and the same messages make the same session
  /// @param rate_hz planning steps a second; 0: what this machine sustains, which takes a wall
  /// @param keep gets the recordings that the operator requests; empty: nothing can be recorded
  static Result<std::unique_ptr<BrowserSession>> make(BrowserSetup setup, std::function<Time()> wall,
                                                      double rate_hz = 0.0, KeptRecordings::Keep keep = {});

  /// A client's number, or 0: no place. The outbox must live until leave().
  std::uint64_t join(Outbox& outbox, Time now);
  void leave(std::uint64_t client, Time now);
  /// A message of docs/reference/protocol.md, or any bytes at all.
  void receive(std::uint64_t client, std::string_view text, Time now);
  /// All that is due by then. Call it some hundred times a second. @param now of the caller's monotonic clock
  void advance(Time now);

  const OneThreadSession& session() const { return *session_; }
  /// Pauses that were left out so far.
  std::uint64_t pauses() const { return pauses_; }
  /// Total time that was left out of these pauses.
  Time left_out() const { return left_out_; }
  /// Called for every command, some milliseconds later; for tests.
  std::function<void(const JointCommand&)> on_command;

 private:
  BrowserSession(BrowserSetup setup, std::function<Time()> wall);
  void publish();

  BrowserSetup setup_;
  SteppedClock clock_;
  std::unique_ptr<SimulatedArm> arm_;
  std::unique_ptr<OneThreadSession> session_;
  std::optional<SessionRecorder> recorder_;
  std::unique_ptr<OperatorInterface> operator_interface_;
  ServerFacts facts_;
  ServerCallbacks callbacks_;
  std::unique_ptr<Hub> hub_;
  std::optional<Time> behind_;  ///< how far the session's clock is behind the caller's; none: not started
  Time next_tick_{0}, next_state_{0};
  std::uint64_t pauses_ = 0;
  Time left_out_{0};
};

}  // namespace steadyhand
