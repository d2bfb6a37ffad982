#pragma once

#include <array>
#include <atomic>
#include <deque>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "steadyhand/arms/driver/simulated_arm.hpp"
#include "steadyhand/arms/ur/rtde_client.hpp"
#include "steadyhand/arms/ur/ur_modes.hpp"
#include "steadyhand/arms/ur/ur_primary.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "support/manual_clock.hpp"
#include "support/ur/urscript.hpp"

namespace steadyhand {

/// The controller of a Universal Robots arm as its documents and the manufacturer's client library describe it, with
/// the simulated arm behind it: RTDE versions 1 and 2, programs over the primary interface (run by urscript.hpp, a
/// cycle at a time), the dashboard or PolyScope X's Robot API, protective stops, pause, remote control, speed slider,
/// reduced mode. Undocumented behaviour is marked [?], and is the choice that is hardest on clients. Not simulated:
/// forces, inverse kinematics, movel and movec, and the time that a real controller takes to compile a program. One
/// thread calls everything but run().
class FakeUrController {
 public:
  /// Speeds in m/s beyond which the safety system stops the arm.
  struct SpeedCaps {
    double tool = std::numeric_limits<double>::infinity(), elbow = tool;
  };
  struct Settings {
    ControllerVersion version{5, 12, 0, 1101534};  ///< 3.x: a CB3, at 125 Hz; 10.x: PolyScope X
    int newest_protocol = 2;
    bool remote_control = true;  ///< otherwise connections opened meanwhile cannot send programs (but to a CB3)
    bool paused = true;          ///< is the program after switching on
    double servo_lag = 0.03;     ///< s, time constant of servoj, for any lookahead
    /// The interpreter's limit: what a thread may evaluate in a cycle; if it needs more, it continues in the next [?].
    int budget = 1200;
    double unlock_wait = 5.0;  ///< s after a protective stop in which it cannot be unlocked
    SpeedCaps normal{}, reduced{0.75, 0.75};
    std::optional<UrKinematics> kinematics;  ///< sent on the primary interface
    double payload = 0.0;                    ///< kg, set at the pendant
    std::array<double, 6> tcp{};             ///< m, rad, the same
    std::string address = "127.0.0.1";
    /// Of RTDE, scripts, and dashboard or Robot API; 0: any free one. run() listens there.
    std::uint16_t rtde_port = 0, script_port = 0, dashboard_port = 0;
    bool polyscope_x() const { return version.major >= 10; }
  };

  /// The model must outlive it. The arm starts at the model's home, stationary.
  FakeUrController(const RobotModel& model, const Settings& settings);
  ~FakeUrController();

  /// Listens; fails with the address and the reason.
  Status listen();
  std::uint16_t rtde_port() const { return ports_[0]; }
  std::uint16_t script_port() const { return ports_[1]; }
  std::uint16_t dashboard_port() const { return ports_[2]; }
  /// One end of a connection that did not need a port.
  void accept_rtde(Socket socket);
  void accept_script(Socket socket);

  /// Takes in what clients sent; no time passes.
  void serve();
  /// One control cycle.
  void step();
  double period() const { return 1.0 / settings_.version.rate_hz(); }
  /// Cycles in real time, on a separate thread, until stop(). Faults may be injected meanwhile.
  void run();
  void stop();

  // ---- faults; any thread
  /// The cable is out for `cycles`: nothing is received or sent; then everything arrives at once, as with TCP.
  void unplug(int cycles) { unplugged_ = cycles; }
  /// Everything that is sent arrives `cycles` later.
  void lag(int cycles) { lag_ = cycles; }
  void protective_stop() { protective_asked_ = true; }
  /// The pendant's buttons. Not during run().
  void press_stop() { end_program("stopped at the pendant"); }
  void press_pause() { paused_ = true; }
  /// Continues the paused program, if the safety system lets the arm move.
  bool press_play();
  /// As a person does it: waits until the controller unlocks. Not while run() does.
  void unlock();
  void drop_connections() { drop_asked_ = true; }
  void set_slider(double share) { slider_ = share; }
  void set_remote(bool remote) { remote_ = remote; }
  /// Runs another program, from the pendant. Not during run().
  void play_foreign_program();
  /// Any of these by its name, before the next cycle: pause, play, stop, foreign, protective, unlock, reduced, normal,
  /// safeguard, local, remote, off, on, slider NUMBER, lag CYCLES, unplug CYCLES. False: none of these.
  bool ask(const std::string& what);
  void set_mode(UrRobotMode mode) { mode_ = mode; }
  void set_safety(UrSafety safety) { safety_ = safety; }

  const SimulatedArm& arm() const { return *arm_; }
  const JointVector& target() const { return target_; }
  /// Largest change of the target's speed in one cycle so far, rad/s^2.
  double largest_acceleration() const { return largest_acceleration_; }
  double largest_speed() const { return largest_speed_; }
  /// Largest step of the target, rad, from cycle to cycle, beyond what the mean of both cycles' speeds explains.
  double largest_position_step() const { return largest_position_step_; }
  /// Largest change of the target's speed in one cycle, rad/s.
  double largest_speed_step() const { return largest_acceleration_ * period(); }
  /// Cycles in which the program followed and no new set-point had come: late, lost, or not sent.
  std::uint64_t unanswered() const { return unanswered_; }
  UrRuntime runtime() const {
    return paused_ ? UrRuntime::kPaused : program_ != nullptr ? UrRuntime::kPlaying : UrRuntime::kStopped;
  }
  std::int32_t output_integer(int i) const { return int_out_[i]; }
  bool program_running() const { return program_ != nullptr; }
  const std::string& program_name() const { return program_ != nullptr ? program_->name() : no_program_; }
  /// Cycles in which a program wanted more than the interpreter's budget, and the most that it took in one.
  std::uint64_t overruns() const { return overruns_; }
  int largest_effort() const { return largest_effort_; }
  const std::string& last_error() const { return last_error_; }
  /// The programs' textmsg output.
  const std::vector<std::string>& log() const { return log_; }
  double time() const { return time_; }
  /// Something went out in the last cycle.
  bool spoke() const { return spoke_; }

 private:
  struct Recipe {
    std::uint8_t id = 0;
    std::vector<std::string> names, types;
  };
  struct RtdePeer {
    Socket socket;
    RtdeFramer framer;
    int protocol = 1;  ///< until negotiated
    bool started = false, gone = false;
    double rate_hz = 125.0, due = 0.0;
    Recipe output;
    std::vector<Recipe> inputs;
    std::deque<std::pair<std::uint64_t, std::vector<std::uint8_t>>> queue;  ///< cycle in which it goes out
  };
  struct TextPeer {
    Socket socket;
    std::string text;
    bool gone = false, dashboard = false;
    bool writable = true;  ///< settled when it was accepted
    bool told = false;     ///< version and kinematics
  };

  void accept_all();
  void serve_rtde(RtdePeer& peer);
  void answer(RtdePeer& peer, const RtdePacket& packet);
  void set_up(RtdePeer& peer, const RtdePacket& packet);
  void take_inputs(RtdePeer& peer, RtdeReader data);
  void send(RtdePeer& peer, RtdeWriter& writer);
  void flush(RtdePeer& peer);
  void tell(TextPeer& peer, const std::string& bytes);
  void tell_error(TextPeer& peer, int code, int level, const std::string& text);
  void tell_exception(const std::string& error);
  void tell_state(TextPeer& peer);
  void put_output(RtdeWriter& writer, const std::string& name, const std::string& type) const;
  bool taken_by_other(const RtdePeer& peer, const std::string& name) const;
  void serve_text(TextPeer& peer);
  void take_scripts(TextPeer& peer);
  void serve_http(TextPeer& peer);
  std::string dashboard(const std::string& command);
  std::string robot_api(const std::string& method, const std::string& path, const std::string& body, int& status);
  bool try_unlock();
  void start_program(const std::string& source);
  void run_program();
  void end_program(const std::string& why);
  void press(const std::string& what);
  void make_builtins();
  urscript::Value move(const urscript::Arguments& arguments, urscript::Waiting& thread);
  urscript::Value brake(double deceleration, urscript::Waiting& thread);
  void advance_robot();
  void watch_speeds();
  void count_unanswered();
  bool may_move() const;
  JointVector joints(const urscript::Value& value) const;

  Settings settings_;
  RobotModel model_;  ///< with limits at which a controller stops: far beyond those that plans keep
  ManualClock arm_clock_;
  std::unique_ptr<SimulatedArm> arm_;
  ArmState measured_;
  std::atomic<UrRobotMode> mode_{UrRobotMode::kRunning};
  std::atomic<UrSafety> safety_{UrSafety::kNormal};
  JointVector target_, target_dq_;
  JointVector wanted_, move_begin_;  ///< the motion command's goal, and where it began
  double progress_ = 1.0;            ///< share of the motion command's cycle: 1 when it is over
  double scaling_ = 1.0;             ///< follows the slider
  bool moves_ = false, spoke_ = false;
  bool paused_ = true;
  std::atomic<bool> remote_{true};
  std::atomic<double> slider_{1.0};
  double stopped_at_ = -1e9;  ///< s, when the last protective stop came
  Kinematics kinematics_;
  Vector3 tool_ = Vector3::Zero(), elbow_ = Vector3::Zero();  ///< where they were
  bool watched_ = false;
  std::uint64_t overruns_ = 0;
  int largest_effort_ = 0;
  double largest_acceleration_ = 0.0, largest_speed_ = 0.0, largest_position_step_ = 0.0, time_ = 0.0;
  std::uint64_t cycle_ = 0, unanswered_ = 0;
  std::int32_t last_answer_ = 0;

  urscript::Builtins builtins_;
  std::unique_ptr<urscript::Program> program_;
  std::string last_error_, no_program_;
  std::vector<std::string> log_;
  std::array<double, 48> double_in_{}, double_out_{};
  std::array<std::int32_t, 48> int_in_{}, int_out_{};

  std::array<Socket, 3> listeners_;
  std::array<std::uint16_t, 3> ports_{};
  std::vector<std::unique_ptr<RtdePeer>> rtde_peers_;
  std::vector<std::unique_ptr<TextPeer>> text_peers_;

  std::mutex asked_mutex_;
  std::vector<std::string> asked_;
  std::atomic<int> unplugged_{0}, lag_{0};
  std::atomic<bool> protective_asked_{false}, drop_asked_{false}, running_{false};
  std::thread thread_;
};

}  // namespace steadyhand
