#include "steadyhand/arms/driver/composite_arm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <span>
#include <thread>
#include <utility>

#include "steadyhand/core/latest_value.hpp"
#include "steadyhand/core/spsc_ring.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

namespace {

constexpr double kAlone = 0.1;      ///< s without a command after which an arm stops by itself ...
constexpr double kAloneCycles = 3;  ///< ... or so many cycles, if that is longer; likewise without a state
constexpr double kEasy = 0.2;       ///< s, of a stop after missed cycles, until the control loop takes over
/// Cycles of the pacing arm by which the other's commands are late at least: a plan that starts in the cycle before
/// arrives in time, also from a control loop that wakes late.
constexpr double kHeadStart = 1.5;
constexpr double kOnPlan = 1e-6;    ///< rad, rad/s, between a command and its plan: rounding only
constexpr double kSetPoint = 0.01;  ///< rad (m), most between the position of an arm that is held and its set-point
constexpr Time kFirstState = std::chrono::seconds(1);
constexpr std::size_t kOrders = 64;  ///< plans on their way to an arm
constexpr std::string_view kSilentLoop = "no command arrived in time", kSilentArm = "it does not report its state",
                           kThrew = "its driver failed", kNoNumbers = "the arm reports no numbers";

void part_of(const Plan& whole, int first, int n, Plan& part) {
  const int all = whole.joints;
  part.stamp = whole.stamp;
  part.start = whole.start;
  part.dt = whole.dt;
  part.joints = n;
  part.intervals = whole.intervals;
  part.world = whole.world;
  part.origin = whole.origin;
  for (int k = 0; k <= whole.intervals; ++k) {
    part.x[k].resize(2 * n);
    part.x[k] << whole.x[k].segment(first, n), whole.x[k].segment(all + first, n);
    if (k < whole.intervals) part.u[k] = whole.u[k].segment(first, n);
  }
}

}  // namespace

/// The session's clock, or on one thread that of an arm which is brought up to it cycle by cycle.
class PartClock final : public Clock {
 public:
  explicit PartClock(Clock& session) : session_(&session) {}
  void keep_own() { at_ = session_->now(); }
  Time now() const override { return at_.value_or(session_->now()); }
  void sleep_until(Time deadline) override {
    if (!at_) return session_->sleep_until(deadline);
    at_ = std::max(*at_, deadline);
  }

 private:
  Clock* session_;
  std::optional<Time> at_;
};

/// A plan for an arm.
struct PartOrder {
  Plan plan;
  Time from{0};                  ///< followed from then on
  std::uint64_t departures = 0;  ///< of the arm, that it continues from
};

/// The rest that the control loop wants of an arm.
struct PartWish {
  Time commanded{0};  ///< cycle of the newest command
  std::optional<double> gripper{};
  std::uint64_t restarts = 0, halts = 0;
};

/// What the control loop must know of an arm.
struct PartReport {
  ArmState state;
  JointCommand set_point;        ///< while it follows
  std::uint64_t departures = 0;  ///< from its plans, so far
  JointCommand departed;         ///< the last one's first set-point; from there it brakes
  std::string_view halted;       ///< why it obeys no plans until restart()
  std::uint64_t restarts = 0;    ///< obeyed
};

Result<RobotModel> arm_of(const RobotModel& robot, int tool) {
  if (robot.tool_count() != kMaxTools) {
    return Error{fmt::format("robot '{}' has one tool; two drivers are for robots with two", robot.name)};
  }
  const std::vector<int> own = robot.chain(robot.tools[tool].link), others = robot.chain(robot.tools[1 - tool].link);
  for (const int k : own) {
    if (std::find(others.begin(), others.end(), k) == others.end()) continue;
    return Error{
        fmt::format("joint '{}' of robot '{}' moves both arms: one driver must have all joints (--arm sim, mujoco, or "
                    "ros2 with one controller)",
                    robot.joints[k].name, robot.name)};
  }
  const int first = own.front(), n = static_cast<int>(own.size());
  if (own.back() != first + n - 1) {
    return Error{
        fmt::format("the joints of arm '{}' of robot '{}' do not follow one another: one driver must have all "
                    "joints",
                    robot.tools[tool].name, robot.name)};
  }
  RobotModel arm;
  arm.name = robot.name + " " + robot.tools[tool].name;
  arm.meshes = robot.meshes;
  arm.mount = robot.mount;
  arm.link_names = {robot.link_names.front()};
  for (const int k : own) {
    arm.joints.push_back(robot.joints[k]);
    arm.joints.back().parent = Joint::kBefore;
    arm.link_names.push_back(robot.link_names[k + 1]);
  }
  arm.tools = {robot.tools[tool]};
  arm.tools[0].link -= first;
  for (const auto member : {&RobotModel::home, &RobotModel::position_min, &RobotModel::position_max,
                            &RobotModel::velocity_max, &RobotModel::acceleration_max}) {
    arm.*member = (robot.*member).segment(first, n);
  }
  return arm;
}

int first_joint_of(const RobotModel& robot, int tool) { return robot.chain(robot.tools[tool].link).front(); }

/// An arm, and the plan that it follows. receive() and command() belong to one thread.
struct CompositeArm::Part {
  Part(const RobotModel& of, int first_joint, Clock& session)
      : model(of), first(first_joint), clock(session), orders(kOrders) {}
  ~Part() {
    running = false;
    if (thread.joinable()) thread.join();
  }

  const std::string& name() const { return model.tools[0].name; }
  bool follows() const { return report.state.status == ArmStatus::kFollowing; }
  bool is_finite() const { return report.state.joints.q.allFinite() && report.state.joints.dq.allFinite(); }
  Time now() const { return report.state.joints.stamp.made; }

  void receive();
  void command(const JointCommand* given);
  void step();
  void run(const std::function<void()>& on_thread);

  RobotModel model;
  int first;  ///< joint in the robot
  PartClock clock;
  std::unique_ptr<Arm> arm;
  Time period{0}, late{0};  ///< late: from the time of a plan to that of its execution
  Time alone{0};            ///< see kAlone

  SpscRing<PartOrder> orders;
  LatestValue<PartWish> wishes;
  LatestValue<PartReport> reports;
  std::atomic<bool> threw{false}, running{true};

  // ---- of the arm's thread
  PartReport report;
  PartWish wish;
  PartOrder order;
  bool pending = false;  ///< order is to be followed later
  bool obeys = false;    ///< follows a plan of the control loop; otherwise it is held, or brakes
  bool changed = false;  ///< the arm does not know the plan yet
  bool has_plan = false;
  Plan plan;                ///< on the arm's time
  std::uint64_t halts = 0;  ///< obeyed
  std::thread thread;

  // ---- of the control thread
  PartReport seen;
  PartOrder posted;

 private:
  void depart(const JointCommand& from);
  void halt(std::string_view why);
  void obey_wishes();
};

/// Leaves its plans: brakes from there on, and holds.
void CompositeArm::Part::depart(const JointCommand& from) {
  make_straight_stop(model, from, kEasy, plan);
  report.departed = from;
  ++report.departures;
  obeys = false;
  has_plan = changed = true;
}

void CompositeArm::Part::halt(std::string_view why) {
  depart(sample(plan, now()));
  report.halted = why;
}

void CompositeArm::Part::obey_wishes() {
  (void)wishes.read(wish);
  if (std::exchange(halts, wish.halts) != wish.halts && has_plan) depart(sample(plan, now()));
  if (wish.restarts == report.restarts) return;
  report.restarts = wish.restarts;
  report.halted = {};
  if (follows() && is_finite()) {
    if (has_plan) depart(sample(plan, now()));
    return;
  }
  arm->restart();
  report.state.status = ArmStatus::kStarting;
  report.state.reason = {};
}

void CompositeArm::Part::receive() {
  report.state = arm->receive();
  obey_wishes();
  if (!follows()) {
    if (std::exchange(has_plan, false)) ++report.departures;
    obeys = false;
    report.set_point = {};
    return;
  }
  if (!has_plan && is_finite()) {
    stand(report.state.joints.q, now(), plan);
    depart(sample(plan, now()));
  } else if (has_plan && report.state.carried_on) {
    depart(*report.state.carried_on);
  }
  if (report.halted.empty() && has_plan && !is_finite()) halt(kNoNumbers);
  if (report.halted.empty() && obeys && now() - wish.commanded > alone) halt(kSilentLoop);
  if (has_plan) report.set_point = sample(plan, now());
}

/// Takes the plans whose time has come, and sends the set-point of this cycle. @param given that of the newest plan
void CompositeArm::Part::command(const JointCommand* given) {
  (void)wishes.read(wish);
  while (pending || orders.pop(order)) {
    pending = order.departures == report.departures;
    if (!pending) continue;
    if (order.from + late > now()) break;
    pending = false;
    plan = order.plan;
    plan.start += late;
    obeys = changed = has_plan = true;
  }
  if (!follows() || !has_plan) return;
  if (std::exchange(changed, false)) arm->follow(plan);
  JointCommand next = sample(plan, now());
  if (obeys && given != nullptr) next = *given;
  next.gripper[0] = wish.gripper;
  report.set_point = next;
  arm->send(next);
}

void CompositeArm::Part::step() {
  receive();
  command(nullptr);
  reports.write(report);
}

void CompositeArm::Part::run(const std::function<void()>& on_thread) {
  if (on_thread) on_thread();
  while (running) {
    try {
      step();
    } catch (const std::exception&) {
      threw = true;
      clock.sleep_until(clock.now() + period);
    }
  }
}

// ---------------------------------------------------------------------------------------------- the control thread

Result<std::unique_ptr<CompositeArm>> CompositeArm::make(const RobotModel& robot,
                                                         const std::array<Make, kMaxTools>& make, Clock& clock,
                                                         Turns turns, std::function<void()> on_thread) {
  std::unique_ptr<CompositeArm> arm(new CompositeArm(robot, clock));
  for (int i = 0; i < kMaxTools; ++i) {
    const Result<RobotModel> model = arm_of(robot, i);
    if (!model) return model.error();
    arm->parts_[i] = std::make_unique<Part>(*model, first_joint_of(robot, i), clock);
    Part& part = *arm->parts_[i];
    auto made = make[i](part.model, part.clock);
    if (!made) return Error{fmt::format("arm '{}': {}", part.name(), made.error().message)};
    part.arm = *std::move(made);
  }
  arm->pair_up(turns, std::move(on_thread));
  return arm;
}

void CompositeArm::pair_up(Turns turns, std::function<void()> on_thread) {
  const ArmInfo &left = parts_[0]->arm->info(), &right = parts_[1]->arm->info();
  pacing_ = std::pair(right.delay, right.rate_hz) > std::pair(left.delay, left.rate_hz) ? 1 : 0;
  const ArmInfo &first = pacing().arm->info(), &second = other().arm->info();
  other().late = from_seconds(std::max(kHeadStart / first.rate_hz, first.delay - second.delay));
  info_ = {fmt::format("{}: {}; {}: {}", parts_[0]->name(), left.name, parts_[1]->name(), right.name),
           robot_->dof(),
           first.rate_hz,
           std::max(first.delay, second.delay + to_seconds(other().late)),
           left.hardware || right.hardware,
           {left.gripper[0], right.gripper[0]}};
  period_ = from_seconds(1.0 / first.rate_hz);
  for (const auto& part : parts_) {
    part->period = from_seconds(1.0 / part->arm->info().rate_hz);
    part->alone =
        std::max(from_seconds(kAlone), from_seconds(kAloneCycles * std::max(1.0 / left.rate_hz, 1.0 / right.rate_hz)));
  }
  stand(robot_->home, Time(0), plan_);
  one_thread_ = turns == Turns::kOneThread;
  if (one_thread_) {
    other().clock.keep_own();
  } else {
    other().thread = std::thread([part = &other(), begins = std::move(on_thread)] { part->run(begins); });
  }
}

CompositeArm::CompositeArm(const RobotModel& robot, Clock& clock) : robot_(&robot), clock_(&clock), check_(robot) {}
CompositeArm::~CompositeArm() = default;

ArmState CompositeArm::receive() {
  Part &first = pacing(), &second = other();
  if (now_ == Time(0)) await_first_state();
  first.receive();
  now_ = first.now();
  while (one_thread_ && second.clock.now() + second.period <= clock_->now()) second.step();
  first.seen = first.report;
  (void)second.reports.read(second.seen);
  ArmState state;
  state.cycle = first.seen.state.cycle;
  state.joints.stamp = first.seen.state.joints.stamp;
  join_states(state);
  proceed(state);
  if (passes_) tell_what_was_carried_on(state);
  if (!passes_) first.command(nullptr);
  q_ = state.joints.q;
  return state;
}

void CompositeArm::await_first_state() {
  Part& second = other();
  if (one_thread_) {
    second.clock.keep_own();
    return second.step();
  }
  const Time until = clock_->now() + kFirstState;
  while (!second.reports.read(second.seen) && clock_->now() < until) clock_->sleep_until(clock_->now() + second.period);
}

/// Joints of both at the time of the pacing arm's state. An arm that is held counts as being at its set-point: the
/// first command must be there.
void CompositeArm::join_states(ArmState& state) {
  state.joints.q = robot_->home;
  state.joints.dq = JointVector::Zero(robot_->dof());
  for (int i = 0; i < kMaxTools; ++i) {
    const auto& [reported, set_point, departures, departed, halted, restarts] = parts_[i]->seen;
    const JointState& joints = reported.joints;
    const int first = parts_[i]->first, n = parts_[i]->model.dof();
    if (joints.q.size() != n) continue;  // no state yet
    const double age = std::clamp(to_seconds(now_ - joints.stamp.made), -kAlone, kAlone);
    JointVector q = joints.q + age * joints.dq;
    const bool is_held = status_ == ArmStatus::kStarting && reported.status == ArmStatus::kFollowing;
    if (is_held && set_point.q.size() == n && (set_point.q - q).cwiseAbs().maxCoeff() < kSetPoint) q = set_point.q;
    state.joints.q.segment(first, n) = q;
    state.joints.dq.segment(first, n) = joints.dq;
    state.joints.gripper[i] = joints.gripper[0];
  }
}

/// The status of both, and why they stopped.
void CompositeArm::proceed(ArmState& state) {
  bool all_follow = true, one_obeys = false;
  for (int i = 0; i < kMaxTools; ++i) {
    Part& part = *parts_[i];
    const PartReport& seen = part.seen;
    const bool knows = seen.restarts == restarts_;  // of the last restart()
    const bool is_late = now_ - seen.state.joints.stamp.made > part.alone;
    const bool follows = knows && seen.state.status == ArmStatus::kFollowing && seen.halted.empty();
    std::string_view why = seen.halted;
    if (why.empty() && seen.state.status == ArmStatus::kStopped) why = seen.state.reason;
    if (!knows) why = {};
    if (is_late && seen.state.cycle > 0) why = kSilentArm;
    if (part.threw) why = kThrew;
    if (!why.empty() && status_ != ArmStatus::kStopped) {
      std::span<char> place = words_[next_words_++ % words_.size()];
      const auto end = fmt::format_to_n(place.data(), place.size(), "{}: {}", part.name(), why).out;
      reason_ = {place.data(), static_cast<std::size_t>(end - place.data())};
      status_ = ArmStatus::kStopped;
    }
    all_follow = all_follow && follows && seen.set_point.q.size() > 0 && seen.set_point.dq.isZero(0.0);
    one_obeys = one_obeys || (follows && why.empty());
  }
  if (status_ == ArmStatus::kStarting && all_follow) {
    status_ = ArmStatus::kFollowing;
    passes_ = true;
    check_.restart();
    wish({});
    for (int i = 0; i < kMaxTools; ++i) answered_[i] = parts_[i]->seen.departures;
  }
  if (status_ != ArmStatus::kFollowing && !one_obeys) passes_ = false;
  state.status = status_;
  state.reason = reason_;
  state.part_follows = status_ == ArmStatus::kStopped && passes_;
}

/// An arm that missed cycles, or commands in them, left its plans: they must continue from where it is. It gets them
/// later than the pacing one, and brakes until then.
void CompositeArm::tell_what_was_carried_on(ArmState& state) {
  const Time then = now_ - period_;
  JointCommand own = sample(plan_, then);
  bool departed = false;
  for (int i = 0; i < kMaxTools; ++i) {
    Part& part = *parts_[i];
    const PartReport& seen = part.seen;
    if (seen.departures == answered_[i] || seen.state.status != ArmStatus::kFollowing || !seen.halted.empty()) continue;
    answered_[i] = seen.departures;
    departed = true;
    make_straight_stop(part.model, seen.departed, kEasy, part.posted.plan);
    const JointCommand from = sample(part.posted.plan, then + part.late);
    const int n = part.model.dof();
    own.q.segment(part.first, n) = from.q;
    own.dq.segment(part.first, n) = from.dq;
    own.ddq.segment(part.first, n) = from.ddq;
  }
  if (!departed) return;
  state.carried_on = own;
  unposted_ = true;
  check_.restart();
  check_.take(own);
}

void CompositeArm::post(Time from) {
  unposted_ = false;
  for (int i = 0; i < kMaxTools; ++i) {
    Part& part = *parts_[i];
    part_of(plan_, part.first, part.model.dof(), part.posted.plan);
    part.posted.from = from;
    part.posted.departures = answered_[i];
    if (!part.orders.push(part.posted)) halt("plans come faster than an arm takes them");
  }
}

void CompositeArm::follow(const Plan& plan) {
  plan_ = plan;
  if (passes_) post(plan_.start);
}

void CompositeArm::wish(const PerTool<std::optional<double>>& gripper) {
  for (int i = 0; i < kMaxTools; ++i) parts_[i]->wishes.write({now_, gripper[i], restarts_, halts_});
}

void CompositeArm::send(const JointCommand& command) {
  if (!passes_) return;
  if (const std::string_view why = check_.refusal(command, q_); !why.empty()) return halt(why);
  const JointCommand on_plan = sample(plan_, command.stamp.made);
  if ((on_plan.q - command.q).cwiseAbs().maxCoeff() > kOnPlan ||
      (on_plan.dq - command.dq).cwiseAbs().maxCoeff() > kOnPlan) {
    return halt("a command is not on the plan that was checked");
  }
  if (unposted_) post(now_ - period_);
  wish(command.gripper);
  Part& part = pacing();
  const int n = part.model.dof();
  const JointVector ddq = command.ddq.size() == robot_->dof() ? command.ddq : on_plan.ddq;
  const JointCommand own{command.stamp, command.q.segment(part.first, n), command.dq.segment(part.first, n),
                         ddq.segment(part.first, n)};
  part.command(&own);
}

/// Both arms brake, and are held until restart().
void CompositeArm::halt(std::string_view reason) {
  if (status_ != ArmStatus::kStopped) reason_ = reason;
  status_ = ArmStatus::kStopped;
  passes_ = false;
  ++halts_;
  wish({});
}

void CompositeArm::restart() {
  status_ = ArmStatus::kStarting;
  reason_ = {};
  passes_ = unposted_ = false;
  ++restarts_;
  wish({});
}

}  // namespace steadyhand
