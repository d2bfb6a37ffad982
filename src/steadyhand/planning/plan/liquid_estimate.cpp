#include "steadyhand/planning/plan/liquid_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

LiquidEstimate::LiquidEstimate(const RobotModel& model, const LiquidSettings& settings, int tool)
    : arm_(model), tool_(tool), settings_(settings) {
  set_glass(settings.glass);
}

void LiquidEstimate::set_glass(const GlassSettings& glass) {
  settings_.glass = glass;
  model_ = SloshModel(glass, 1.0, settings_.frequencies);  // for its heights
  frequency_ = slosh_frequency(glass);
  damping_ = slosh_damping(glass);
}

SloshState LiquidEstimate::at_rest(const JointVector& q) {
  arm_.set_position(q);
  return model_.at_rest(arm_.R(tool_).transpose() * kGravity);
}

double LiquidEstimate::period() const {
  return 2.0 * M_PI / (frequency_ * *std::min_element(settings_.frequencies.begin(), settings_.frequencies.end()));
}

double LiquidEstimate::wave(const SloshState& state) const {
  double highest = 0.0;
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const auto [x, y, swing_x, swing_y] = model_.wave<double>(state, mode);
    highest = std::max(highest, std::hypot(x, y));
  }
  return highest;
}

/// Velocity Verlet steps with the force at their middle.
double LiquidEstimate::advance(JointVector& q, JointVector& dq, const JointVector& u, double duration,
                               SloshState& state) {
  constexpr double kStep = 0.0125;  // s: a twentieth of the period in a drinking glass
  const int steps = std::max(1, static_cast<int>(std::ceil(duration / kStep - 1e-9)));
  const double h = duration / steps;
  double highest = 0.0;
  for (int i = 0; i < steps; ++i) {
    arm_.set_position(q + 0.5 * h * dq + 0.125 * h * h * u);
    arm_.set_motion(dq + 0.5 * h * u, u);
    const Vector3 force = arm_.local_acceleration(tool_);
    const double gamma = force.z() / kGravity.z();
    for (int mode = 0; mode < kSloshModes; ++mode) {
      const double w = settings_.frequencies[mode] * frequency_;
      for (int axis = 0; axis < 2; ++axis) {
        double &x = state[slosh_entry(mode, axis)], &v = state[slosh_entry(mode, axis) + 1];
        v += 0.5 * h * w * (force[axis] - gamma * x);
        x += h * w * v;
        v += 0.5 * h * w * (force[axis] - gamma * x);
        v *= std::exp(-2.0 * damping_ * w * h);
      }
    }
    state.tail<3>() = force;
    highest = std::max(highest, wave(state));
    q += h * dq + 0.5 * h * h * u;
    dq += h * u;
  }
  // In a falling or upside-down glass the mode would grow without bound; a real liquid does not.
  constexpr double kMost = 200.0;  // m/s^2
  state = state.cwiseMax(-kMost).cwiseMin(kMost);
  return highest;
}

/// After arm_.set_position: each mode swings about its rest and decays.
void LiquidEstimate::stand(double duration, SloshState& state) const {
  const Vector3 force = arm_.R(tool_).transpose() * kGravity;
  const SloshState rest = model_.at_rest(force);
  const double gamma = std::max(0.1, force.z() / kGravity.z());
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const double w = settings_.frequencies[mode] * frequency_, fast = std::sqrt(gamma);
    const double c = std::cos(w * fast * duration), s = std::sin(w * fast * duration);
    const double fade = std::exp(-damping_ * w * duration);
    for (int axis = 0; axis < 2; ++axis) {
      const int i = slosh_entry(mode, axis);
      const double x = state[i] - rest[i], v = state[i + 1] / fast;
      state[i] = rest[i] + fade * (c * x + s * v);
      state[i + 1] = fast * fade * (c * v - s * x);
    }
  }
  state.tail<3>() = force;
}

SloshState LiquidEstimate::at(const Plan& plan, const SloshState& state, Time from, Time t) {
  SloshState result = state;
  const int n = plan.joints;
  const double begin = std::max(0.0, to_seconds(from - plan.start)), end = to_seconds(t - plan.start);
  for (int k = 0; k < plan.intervals && k * plan.dt < end; ++k) {
    const double into = std::max(0.0, begin - k * plan.dt), until = std::min(plan.dt, end - k * plan.dt);
    if (into >= until) continue;
    JointVector q = plan.x[k].head(n) + into * plan.x[k].tail(n) + 0.5 * into * into * plan.u[k];
    JointVector dq = plan.x[k].tail(n) + into * plan.u[k];
    (void)advance(q, dq, plan.u[k], until - into, result);
  }
  if (const double over = end - std::max(begin, plan.intervals * plan.dt); over > 1e-9) {
    arm_.set_position(plan.x[plan.intervals].head(n));
    stand(over, result);
  }
  spill(result);
  return result;
}

SloshState LiquidEstimate::between(const JointCommand& first, const JointCommand& second, const SloshState& state) {
  constexpr double kLongest = 1.0;  // s
  const double duration = to_seconds(second.stamp.made - first.stamp.made);
  if (duration > kLongest) return at_rest(second.q);
  SloshState result = state;
  if (duration <= 0.0) return result;
  if (first.dq.isZero(0.0) && second.dq.isZero(0.0)) {
    arm_.set_position(second.q);
    stand(duration, result);
  } else {  // two constant accelerations, which meet in the middle
    const double half = 0.5 * duration;
    const JointVector middle = (second.q - first.q) / half - 0.5 * (first.dq + second.dq);
    JointVector q = first.q, dq = first.dq;
    (void)advance(q, dq, (middle - first.dq) / half, half, result);
    (void)advance(q, dq, (second.dq - middle) / half, half, result);
  }
  spill(result);
  return result;
}

void LiquidEstimate::spill(SloshState& state) const {
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const auto wave = model_.wave<double>(state, mode);
    const double swing = Eigen::Map<const Eigen::Vector4d>(wave.data()).norm();
    if (swing > settings_.glass.freeboard())
      state.segment<4>(slosh_entry(mode, 0)) *= settings_.glass.freeboard() / swing;
  }
}

double LiquidEstimate::highest(const Plan& plan, const SloshState& state, Time t) {
  const double begin = std::max(0.0, to_seconds(t - plan.start));
  const int first = static_cast<int>(std::min<double>(plan.intervals, begin / plan.dt));
  return finish(plan, first, begin - first * plan.dt, state);
}

void LiquidEstimate::walk(const Plan& plan, const SloshState& state) {
  SloshState now = state;
  const int n = plan.joints;
  states_[0] = state;
  heights_[0] = 0.0;
  for (int k = 0; k < plan.intervals; ++k) {
    JointVector q = plan.x[k].head(n), dq = plan.x[k].tail(n);
    heights_[k + 1] = std::max(heights_[k], advance(q, dq, plan.u[k], plan.dt, now));
    states_[k + 1] = now;
  }
}

double LiquidEstimate::highest_behind(const Plan& plan, int intervals) {
  return finish(plan, intervals, 0.0, states_[intervals]);
}

/// From `into` s after node `first` on.
double LiquidEstimate::finish(const Plan& plan, int first, double into, SloshState now) {
  const int n = plan.joints;
  double highest = 0.0;
  for (int k = first; k < plan.intervals; ++k) {
    JointVector q = plan.x[k].head(n) + into * plan.x[k].tail(n) + 0.5 * into * into * plan.u[k];
    JointVector dq = plan.x[k].tail(n) + into * plan.u[k];
    highest = std::max(highest, advance(q, dq, plan.u[k], plan.dt - into, now));
    into = 0.0;
  }
  // With the arm at rest the wave follows an ellipse: at most its height at rest plus both half-axes of the ellipse.
  const SloshState rest = at_rest(plan.x[plan.intervals].head(n)), about = now - rest;
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const auto [x, y, swing_x, swing_y] = model_.wave<double>(rest, mode);
    const double swing = about.segment<4>(slosh_entry(mode, 0)).norm();
    highest = std::max(highest, std::hypot(x, y) + model_.height_by_deflection() * swing);
  }
  return highest;
}

}  // namespace steadyhand
