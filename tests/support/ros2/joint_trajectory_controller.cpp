#include "support/ros2/joint_trajectory_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace steadyhand {

namespace {

using Point = JointTrajectory::Point;

/// Position, speed, acceleration at t of the polynomial of degree 1, 3 or 5 that has those of both ends; of what both
/// ends give.
std::array<double, 3> interpolate(const Point& a, const Point& b, std::size_t i, double T, double t) {
  const bool speeds = !a.dq.empty() && !b.dq.empty();
  const bool accelerations = speeds && !a.ddq.empty() && !b.ddq.empty();
  const double d = b.q[i] - a.q[i];
  std::array<double, 6> c{a.q[i], 0, 0, 0, 0, 0};
  if (!speeds) {
    c[1] = d / T;
  } else if (!accelerations) {
    const double v0 = a.dq[i], v1 = b.dq[i];
    c[1] = v0;
    c[2] = (3.0 * d - (2.0 * v0 + v1) * T) / (T * T);
    c[3] = (-2.0 * d + (v0 + v1) * T) / (T * T * T);
  } else {
    const double v0 = a.dq[i], v1 = b.dq[i], a0 = a.ddq[i], a1 = b.ddq[i], T2 = T * T;
    c[1] = v0;
    c[2] = 0.5 * a0;
    c[3] = (20.0 * d - (8.0 * v1 + 12.0 * v0) * T - (3.0 * a0 - a1) * T2) / (2.0 * T2 * T);
    c[4] = (-30.0 * d + (14.0 * v1 + 16.0 * v0) * T + (3.0 * a0 - 2.0 * a1) * T2) / (2.0 * T2 * T2);
    c[5] = (12.0 * d - 6.0 * (v1 + v0) * T + (a1 - a0) * T2) / (2.0 * T2 * T2 * T);
  }
  std::array<double, 3> value{};
  for (int k = 5; k >= 0; --k) {  // Horner, with both derivatives
    value[2] = value[2] * t + 2.0 * value[1];
    value[1] = value[1] * t + value[0];
    value[0] = value[0] * t + c[k];
  }
  return value;
}

std::vector<double> list(const JointVector& values) { return {values.begin(), values.end()}; }

}  // namespace

std::string JointTrajectoryController::refusal(const JointTrajectory& t, Time now) const {
  if (t.joints.empty()) return "no joint names";
  if (t.joints.size() != settings_.joints.size() && !settings_.allow_partial_joints_goal) {
    return fmt::format("{} joints of {}", t.joints.size(), settings_.joints.size());
  }
  for (auto name = t.joints.begin(); name != t.joints.end(); ++name) {
    if (std::find(settings_.joints.begin(), settings_.joints.end(), *name) == settings_.joints.end()) {
      return fmt::format("joint '{}' is not the controller's", *name);
    }
    if (std::find(t.joints.begin(), name, *name) != name) return fmt::format("joint '{}' is named twice", *name);
  }
  if (t.points.empty()) return "no points";
  if (t.stamp != Time(0) && t.stamp + t.points.back().from_start < now) return "it ends in the past";
  Time last(-1);
  for (const Point& point : t.points) {
    if (point.from_start <= last) return "times do not increase";
    last = point.from_start;
    if (point.q.size() != t.joints.size()) return "a point lacks positions";
    if (!point.dq.empty() && point.dq.size() != t.joints.size()) return "a point has too many or too few velocities";
    if (!point.ddq.empty() && point.ddq.size() != t.joints.size()) {
      return "a point has too many or too few accelerations";
    }
  }
  if (settings_.allow_nonzero_velocity_at_trajectory_end) return {};
  for (const double speed : t.points.back().dq) {
    if (std::abs(speed) > std::numeric_limits<float>::epsilon()) return "the last point is not at rest";
  }
  return {};
}

std::string JointTrajectoryController::accept(const JointTrajectory& t, Time now) {
  if (std::string why = refusal(t, now); !why.empty()) return why;
  if (!active_) return "inactive";
  const std::size_t n = settings_.joints.size();
  Motion motion{t.stamp, t.points};
  const auto sort = [&](std::vector<double>& values, double other) {
    if (values.empty()) return;
    std::vector<double> sorted(n, other);
    for (std::size_t i = 0; i < t.joints.size(); ++i) {
      const auto at = std::find(settings_.joints.begin(), settings_.joints.end(), t.joints[i]);
      sorted[at - settings_.joints.begin()] = values[i];
    }
    values = std::move(sorted);
  };
  for (Point& point : motion.points) {
    sort(point.q, NAN);  // NAN: stays where it is
    sort(point.dq, 0.0);
    sort(point.ddq, 0.0);
  }
  waiting_ = std::move(motion);
  holds_ = false;
  aborted_.clear();
  return {};
}

void JointTrajectoryController::activate(const JointVector& q) {
  active_ = true;
  commanded_ = {q, JointVector::Zero(q.size()), JointVector::Zero(q.size())};
  reference_ = commanded_;
  commanded_at_.reset();
  aborted_.clear();
  hold(q);
}

void JointTrajectoryController::deactivate() {
  active_ = false;
  waiting_.reset();
  motion_ = {};
}

/// A trajectory of one point, at once; it starts in the next cycle.
void JointTrajectoryController::hold(const JointVector& q) {
  const std::vector<double> zero(settings_.joints.size(), 0.0);
  waiting_ = Motion{Time(0), {{Time(0), list(q), zero, zero}}};
  holds_ = true;
}

void JointTrajectoryController::begin(Motion motion, const JointVector& q) {
  motion_ = std::move(motion);
  for (Point& point : motion_.points) {
    for (std::size_t i = 0; i < point.q.size(); ++i) {
      if (std::isnan(point.q[i])) point.q[i] = q[i];
    }
  }
  sampled_ = false;
}

/// @return whether the trajectory has positions for that time
bool JointTrajectoryController::sample(Time then, State& state) const {
  if (then < before_at_) return false;
  const Time at = then - motion_.stamp;
  const std::vector<Point>& points = motion_.points;
  const std::size_t n = settings_.joints.size();
  state.q.resize(n);
  state.dq.setZero(n);
  state.ddq.setZero(n);
  const auto take = [&](const Point& a, const Point& b, Time from, Time to) {
    for (std::size_t i = 0; i < n; ++i) {
      const auto value = interpolate(a, b, i, to_seconds(to - from), to_seconds(at - from));
      state.q[i] = value[0];
      state.dq[i] = value[1];
      state.ddq[i] = value[2];
    }
    return true;
  };
  if (at < points.front().from_start) {
    return take(before_, points.front(), before_at_ - motion_.stamp, points.front().from_start);
  }
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    if (at < points[k + 1].from_start) {
      return take(points[k], points[k + 1], points[k].from_start, points[k + 1].from_start);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    state.q[i] = points.back().q[i];
    if (!points.back().dq.empty()) state.dq[i] = points.back().dq[i];
  }
  return true;
}

/// @return whether the next set-point may be written; else the joints are held where they are from the next cycle on
bool JointTrajectoryController::keeps_tolerances(const JointVector& q, Time next, bool first) {
  if (holds_) return true;
  const double error = (reference_.q - q).cwiseAbs().maxCoeff();
  const Time end = motion_.stamp + motion_.points.back().from_start;
  const bool on_the_way = next < end;
  if ((on_the_way || first) && settings_.trajectory > 0.0 && error > settings_.trajectory) {
    aborted_ = "beyond the tolerance on the way";
  } else if (!on_the_way && settings_.goal > 0.0 && error > settings_.goal && settings_.goal_time > 0.0 &&
             to_seconds(time_ - end) > settings_.goal_time) {
    aborted_ = "not at the goal in time";
  } else {
    return true;
  }
  hold(q);
  return false;
}

const JointTrajectoryController::State& JointTrajectoryController::update(Time now, Time period, const JointVector& q,
                                                                          const JointVector& dq) {
  if (!active_) return commanded_;
  const bool deferred = settings_.allow_trajectory_replacement && waiting_ && waiting_->stamp > now;
  if (waiting_ && !deferred) {
    begin(*std::move(waiting_), q);
    waiting_.reset();
  }
  if (motion_.points.empty()) return commanded_;
  const bool first = !sampled_;
  if (first) {
    const JointVector none = JointVector::Zero(q.size());
    const bool from_desired = settings_.interpolate_from_desired_state;
    before_at_ = from_desired ? commanded_at_.value_or(now) : now;
    before_ = from_desired ? Point{Time(0), list(commanded_.q), list(commanded_.dq), list(commanded_.ddq)}
                           : Point{Time(0), list(q), list(dq), list(none)};
    time_ = now;  // earlier slowdowns are forgotten
    if (motion_.stamp == Time(0)) motion_.stamp = now;
    sampled_ = true;
  } else {
    time_ += from_seconds(to_seconds(period) * scaling_);
  }
  (void)sample(time_, reference_);
  const Time next = time_ + settings_.period;
  State wanted;
  if (!sample(next, wanted) || !keeps_tolerances(q, next, first)) return commanded_;
  commanded_ = wanted;
  commanded_at_ = now;
  return commanded_;
}

}  // namespace steadyhand
