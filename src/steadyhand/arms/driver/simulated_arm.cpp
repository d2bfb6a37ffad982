#include "steadyhand/arms/driver/simulated_arm.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "steadyhand/arms/driver/arm_kinds.hpp"
#include "steadyhand/arms/driver/clocked_arm.hpp"

namespace steadyhand {

/// What moves.
class SimulatedArm::Servo final : public ClockedArm {
 public:
  Servo(const RobotModel& model, const JointVector& q, const SimulatedArmSettings& settings, Clock& clock)
      : ClockedArm(model, q,
                   {model.name + " (simulated)", model.dof(), settings.rate_hz, settings.latency + settings.servo_lag,
                    kSimulated.hardware, grippers_of(model)},
                   {settings.bridged, settings.command_timeout, settings.start_time}, clock),
        settings_(settings),
        random_(settings.seed) {}

  ArmState receive() override;
  const JointVector& q() const { return q_; }
  const JointVector& dq() const { return dq_; }
  void trip(std::string_view reason) { interface_.stop(reason); }
  void push(const JointVector& offset) { q_ += offset; }

 private:
  void advance(Time end) override;

  SimulatedArmSettings settings_;
  std::mt19937 random_;
};

ArmState SimulatedArm::Servo::receive() {
  ArmState state = ClockedArm::receive();
  if (settings_.noise > 0.0) {
    std::normal_distribution<double> normal(0.0, settings_.noise);
    for (int i = 0; i < q_.size(); ++i) {
      state.joints.q[i] += normal(random_);
      state.joints.dq[i] += 100.0 * normal(random_);
    }
  }
  if (settings_.quantisation > 0.0) {
    for (double& q : state.joints.q) q = settings_.quantisation * std::round(q / settings_.quantisation);
  }
  return state;
}

void SimulatedArm::Servo::advance(Time end) {
  const double dt = to_seconds(period_);
  for (int i = 0; i < model_->tool_count(); ++i) {
    if (!gripper_[i]) continue;
    const double most = dt / *model_->tools[i].gripper_time;
    *gripper_[i] += std::clamp(*gripper_command_[i] - *gripper_[i], -most, most);
  }
  if (interface_.moves()) {
    const double share = settings_.servo_lag > 0.0 ? -std::expm1(-dt / settings_.servo_lag) : 1.0;
    const JointVector next = q_ + share * (interface_.at(end - from_seconds(settings_.latency)).q - q_);
    dq_ = (next - q_) / dt;
    q_ = next;
  } else {  // brakes
    const JointVector change = (dt * model_->acceleration_max).cwiseMin(dq_.cwiseAbs());
    dq_ -= dq_.cwiseSign().cwiseProduct(change);
    q_ += dt * dq_;
  }
}

SimulatedArm::SimulatedArm(const RobotModel& model, const JointVector& q, const SimulatedArmSettings& settings,
                           Clock& clock)
    : servo_(std::make_unique<Servo>(model, q, settings, clock)) {}
SimulatedArm::~SimulatedArm() = default;

const ArmInfo& SimulatedArm::info() const { return servo_->info(); }
ArmState SimulatedArm::receive() { return servo_->receive(); }
void SimulatedArm::send(const JointCommand& command) { servo_->send(command); }
void SimulatedArm::restart() { servo_->restart(); }
const JointVector& SimulatedArm::q() const { return servo_->q(); }
const JointVector& SimulatedArm::dq() const { return servo_->dq(); }
void SimulatedArm::trip(std::string_view reason) { servo_->trip(reason); }
void SimulatedArm::push(const JointVector& offset) { servo_->push(offset); }

}  // namespace steadyhand
