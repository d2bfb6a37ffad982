#include "predict/predictor.hpp"

#include <cmath>

namespace steadyhand {

Vector3 rotation_vector(const Quaternion& q) {
  const Vector3 v = q.w() < 0.0 ? Vector3(-q.vec()) : Vector3(q.vec());
  const double sine = v.norm();
  if (sine < 1e-12) return 2.0 * v;
  return (2.0 * std::atan2(sine, std::abs(q.w())) / sine) * v;
}

Quaternion rotation(const Vector3& vector) {
  const double angle = vector.norm();
  if (angle < 1e-12) return Quaternion(1.0, 0.5 * vector.x(), 0.5 * vector.y(), 0.5 * vector.z()).normalized();
  return Quaternion(Eigen::AngleAxisd(angle, vector / angle));
}

void Predictor::update(const Target& target) {
  if (count_ > 0 && target.stamp.hand <= newest_.stamp.hand && target.engaged == newest_.engaged) return;
  const bool continues = count_ > 0 && target.engaged && newest_.engaged &&
                         to_seconds(target.stamp.hand - newest_.stamp.hand) <= settings_.max_gap;
  if (!continues) count_ = 0;
  newest_ = target;
  head_ = (head_ + 1) % kCapacity;
  history_[head_] = target;
  count_ = std::min(count_ + 1, kCapacity);
  estimate();
}

void Predictor::estimate() {
  velocity_.setZero();
  angular_velocity_.setZero();
  // Slope of the least-squares line: sum of (t - mean t) y over sum of (t - mean t)^2, times and values relative to the
  // newest.
  double mean_t = 0.0;
  int used = 0;
  const auto entry = [&](int age) -> const Target& { return history_[(head_ - age + kCapacity) % kCapacity]; };
  const auto time = [&](int age) { return to_seconds(entry(age).stamp.hand - newest_.stamp.hand); };
  while (used < count_ && time(used) >= -settings_.window) mean_t += time(used++);
  if (used < 2) return;
  mean_t /= used;
  double spread = 0.0;
  Vector3 translation = Vector3::Zero(), turn = Vector3::Zero();
  for (int age = 0; age < used; ++age) {
    const double t = time(age) - mean_t;
    spread += t * t;
    translation += t * (entry(age).X_base_tool.p - newest_.X_base_tool.p);
    turn += t * rotation_vector(entry(age).X_base_tool.q * newest_.X_base_tool.q.conjugate());
  }
  velocity_ = translation / spread;
  angular_velocity_ = turn / spread;
}

Pose Predictor::at(Time t) const {
  const double elapsed = to_seconds(t - newest_.stamp.hand);
  return {newest_.X_base_tool.p + elapsed * velocity_, rotation(elapsed * angular_velocity_) * newest_.X_base_tool.q};
}

Reference Predictor::predict(Time start) const {
  Reference reference;
  reference.stamp = {newest_.stamp.hand, start};
  reference.start = start;
  reference.dt = settings_.dt;
  reference.nodes = count_ == 0 ? 0 : settings_.horizon;
  for (int k = 0; k < reference.nodes; ++k) {
    const Pose target = at(start + from_seconds((k + 1) * settings_.dt));
    const Vector3 from_center = target.p - settings_.reach_center;
    const double distance = from_center.norm();
    const bool beyond = distance > settings_.reach;
    reference.p[k] = beyond ? Vector3(settings_.reach_center + (settings_.reach / distance) * from_center) : target.p;
    reference.R[k] = target.q.toRotationMatrix();
  }
  return reference;
}

}  // namespace steadyhand
