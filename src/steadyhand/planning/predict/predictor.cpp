#include "steadyhand/planning/predict/predictor.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {
namespace {

bool is_finite(const Pose& pose) {
  return pose.p.allFinite() && std::abs(pose.q.squaredNorm() - 1.0) < 1e-3;  // false for NaN
}

/// Time for which the target's pose holds: a device that predicts its poses does a part of the prediction.
Time time_of(const Target& target) { return target.stamp.hand + target.look_ahead; }

}  // namespace

std::string_view to_string(Prediction prediction) {
  return prediction == Prediction::kDecaying ? "decaying" : "constant_velocity";
}

std::optional<Prediction> prediction_of(std::string_view name) {
  for (const Prediction each : {Prediction::kConstantVelocity, Prediction::kDecaying}) {
    if (name == to_string(each)) return each;
  }
  return std::nullopt;
}

void Predictor::update(const Target& target) {
  if (!is_finite(target.X_base_tool)) return;
  const double elapsed = to_seconds(target.stamp.hand - newest_.stamp.hand);
  const bool late = elapsed <= 0.0 && elapsed >= -settings_.max_gap;
  if (count_ > 0 && late && target.engaged == newest_.engaged) return;
  const bool continues = target.engaged && newest_.engaged && std::abs(elapsed) <= settings_.max_gap;
  if (!continues) count_ = 0;
  if (count_ == 0) {
    filter_.start(target.X_base_tool);
  } else {
    filter_.update(target.X_base_tool, to_seconds(time_of(target) - time_of(newest_)));
  }
  newest_ = target;
  head_ = (head_ + 1) % kCapacity;
  history_[head_] = target;
  count_ = std::min(count_ + 1, kCapacity);
  estimate();
}

void Predictor::estimate() {
  velocity_.setZero();
  angular_velocity_.setZero();
  const auto entry = [&](int age) -> const Target& { return history_[(head_ - age + kCapacity) % kCapacity]; };
  const auto time = [&](int age) { return to_seconds(time_of(entry(age)) - time_of(newest_)); };
  // 1.5: in a window that had to grow, the third newest target has a third of the newest one's weight.
  const double window = std::max(settings_.window, -1.5 * time(std::min(2, count_ - 1)));
  int used = 1;
  while (used < count_ && time(used) > -window) ++used;
  if (-time(used - 1) < settings_.window / 3.0) return;

  // Slope of the weighted least-squares line: sum of w (t - mean t) y over sum of w (t - mean t)^2, times and values
  // relative to the newest.
  const auto weight = [&](int age) { return 1.0 + time(age) / window; };
  double mean_t = 0.0, weights = 0.0;
  for (int age = 0; age < used; ++age) {
    mean_t += weight(age) * time(age);
    weights += weight(age);
  }
  mean_t /= weights;
  double spread = 0.0;
  Vector3 translation = Vector3::Zero(), turn = Vector3::Zero();
  for (int age = 0; age < used; ++age) {
    const double t = time(age) - mean_t;
    spread += weight(age) * t * t;
    translation += weight(age) * t * (entry(age).X_base_tool.p - newest_.X_base_tool.p);
    turn += weight(age) * t * rotation_vector(entry(age).X_base_tool.q * newest_.X_base_tool.q.conjugate());
  }
  velocity_ = translation / spread;
  angular_velocity_ = turn / spread;
}

Vector3 Predictor::velocity() const {
  return settings_.model == Prediction::kDecaying ? filter_.velocity() : velocity_;
}

Vector3 Predictor::angular_velocity() const {
  return settings_.model == Prediction::kDecaying ? filter_.angular_velocity() : angular_velocity_;
}

Pose Predictor::at(Time t) const {
  const double elapsed = to_seconds(t - time_of(newest_));
  if (settings_.model == Prediction::kDecaying && count_ > 0) return filter_.ahead(elapsed);
  return {newest_.X_base_tool.p + elapsed * velocity_, rotation(elapsed * angular_velocity_) * newest_.X_base_tool.q};
}

Spread Predictor::spread(Time t) const {
  if (settings_.model != Prediction::kDecaying || count_ == 0) return {};
  return filter_.spread(to_seconds(t - time_of(newest_)));
}

Reference Predictor::predict(Time start) const {
  Reference reference;
  reference.stamp = {newest_.stamp.hand, start};
  reference.start = start;
  reference.dt = settings_.dt;
  reference.nodes = count_ == 0 ? 0 : std::clamp(settings_.horizon, 0, kMaxHorizon);
  const bool lost = to_seconds(start - newest_.stamp.hand) > settings_.max_gap;
  for (int k = 0; k < reference.nodes; ++k) {
    const Time then = start + from_seconds((k + 1) * settings_.dt);
    const Pose target = lost ? newest_.X_base_tool : at(then);
    const Vector3 from_center = target.p - settings_.reach_center;
    const double distance = from_center.norm();
    const bool beyond = distance > settings_.reach;
    reference.tools[0].p[k] =
        beyond ? Vector3(settings_.reach_center + (settings_.reach / distance) * from_center) : target.p;
    reference.tools[0].R[k] = target.q.toRotationMatrix();
    if (!lost) reference.tools[0].spread[k] = spread(then);
  }
  return reference;
}

}  // namespace steadyhand
