#include "steadyhand/arms/driver/position_interface.hpp"

#include <algorithm>

namespace steadyhand {

namespace {

/// Share of the acceleration limits at which the joints brake when no command comes: a UR's program has 10 of its 15
/// rad/s^2. A pause that is over soon spills less so.
constexpr double kBraking = 2.0 / 3.0;

}  // namespace

PositionInterface::PositionInterface(const RobotModel& model, const PositionInterfaceSettings& settings, Time period,
                                     Time now)
    : settings_(settings),
      period_(period),
      now_(now),
      check_(model),
      carry_on_{settings.bridged, kBraking * model.acceleration_max} {
  restart(now);
}

void PositionInterface::restart(Time now) {
  now_ = now;
  stored_ = 0;
  check_.restart();
  status_ = ArmStatus::kStarting;
  reason_ = {};
  following_since_ = now + from_seconds(settings_.start_time);
}

void PositionInterface::stop(std::string_view reason) {
  status_ = ArmStatus::kStopped;
  reason_ = reason;
}

void PositionInterface::advance(Time now) {
  if (moves() && set_point(0).stamp.made < now_) {  // without a command
    const JointCommand own = steadyhand::carried_on(last_, to_seconds(now_ - last_.stamp.made), carry_on_);
    check_.take(own);
    store(own);
  }
  now_ = now;
  if (status_ == ArmStatus::kStarting && now >= following_since_) status_ = ArmStatus::kFollowing;
  if (status_ == ArmStatus::kFollowing &&
      to_seconds(now - std::max(last_.stamp.made, following_since_)) > settings_.command_timeout) {
    stop("no command arrived in time");
  }
}

void PositionInterface::send(const JointCommand& c, const JointVector& q) {
  if (status_ != ArmStatus::kFollowing) return;
  if (const std::string_view why = check_.refusal(c, q); !why.empty()) return stop(why);
  last_ = c;
  store(c);
}

JointCommand PositionInterface::at(Time t) const {
  int age = 0;
  while (age + 1 < stored_ && set_point(age).stamp.made > t) ++age;
  JointCommand c = set_point(age);
  c.q += std::clamp(to_seconds(t - c.stamp.made), 0.0, 2.0 * to_seconds(period_)) * c.dq;
  return c;
}

std::optional<JointCommand> PositionInterface::carried_on() const {
  if (moves() && set_point(0).stamp.made > last_.stamp.made) return set_point(0);
  return std::nullopt;
}

void PositionInterface::store(const JointCommand& set_point) {
  newest_ = (newest_ + 1) % kHistory;
  set_points_[newest_] = set_point;
  stored_ = std::min(stored_ + 1, kHistory);
}

}  // namespace steadyhand
