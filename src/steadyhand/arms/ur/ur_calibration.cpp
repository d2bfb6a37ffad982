#include "steadyhand/arms/ur/ur_calibration.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "steadyhand/core/turn.hpp"

namespace steadyhand {

namespace {

using Frame = Eigen::Isometry3d;
using Chain = std::array<Frame, 7>;  ///< frames of the joints at zero, then the flange

constexpr double kOtherArm = 0.02, kOtherAxis = 0.1;  // m, rad: the factory corrects by a few mm at most

/// In the base of Denavit and Hartenberg's parameters.
Chain chain_of(const UrKinematics& k, const Frame& base) {
  Chain chain;
  chain[0] = base;
  for (int i = 0; i < 6; ++i) {
    chain[i + 1] = chain[i] * Eigen::AngleAxisd(k.theta[i], Vector3::UnitZ()) *
                   Eigen::Translation3d(k.a[i] * Vector3::UnitX() + k.d[i] * Vector3::UnitZ()) *
                   Eigen::AngleAxisd(k.alpha[i], Vector3::UnitX());
  }
  return chain;
}

Chain chain_of(const RobotModel& model) {
  Chain chain;
  Frame pose = model.mount.inverse();
  for (int i = 0; i < 6; ++i) chain[i] = pose = pose * model.joints[i].origin;
  chain[6] = pose;  // the last link's frame is the flange's
  return chain;
}

}  // namespace

Result<RobotModel> calibrate(const RobotModel& model, const UrKinematics& kinematics, UrDeviation& deviation) {
  const Chain nominal = chain_of(model);
  RobotModel best = model;
  deviation.joint_m = std::numeric_limits<double>::infinity();
  // The URDF's base is turned by half a turn against the controller's, or not.
  for (const double turn : {0.0, M_PI}) {
    const Chain measured = chain_of(kinematics, Frame(Eigen::AngleAxisd(turn, Vector3::UnitZ())));
    RobotModel made = model;
    UrDeviation d;
    Frame last = model.mount.inverse();
    for (int i = 0; i < 6; ++i) {
      const Vector3 axis = measured[i].linear().col(2), before = nominal[i].linear() * model.joints[i].axis;
      const Vector3 point = measured[i].translation();
      Frame pose = nominal[i];
      pose.linear() = turn_between(before, axis) * nominal[i].linear();
      pose.translation() = point + axis.dot(nominal[i].translation() - point) * axis;
      d.joint_m = std::max(d.joint_m, (pose.translation() - nominal[i].translation()).norm());
      d.joint_rad = std::max(d.joint_rad, std::atan2(before.cross(axis).norm(), before.dot(axis)));
      made.joints[i].origin = last.inverse() * pose;
      last = pose;
    }
    made.tools[0].origin = last.inverse() * measured[6] * model.tool().origin;
    d.tool_m =
        ((measured[6] * model.tool().origin).translation() - (nominal[6] * model.tool().origin).translation()).norm();
    if (d.joint_m >= deviation.joint_m) continue;
    deviation = d;
    best = std::move(made);
  }
  if (!(deviation.joint_m < kOtherArm) || !(deviation.joint_rad < kOtherAxis) ||
      !(deviation.tool_m < 2.0 * kOtherArm)) {
    return Error{fmt::format(
        "the connected arm is not a '{}': its axes are up to {:.0f} mm and {:.1f} degrees from those of "
        "the robot file; choose this arm's file with --robot",
        model.name, 1e3 * std::max(deviation.joint_m, deviation.tool_m), deviation.joint_rad * 180.0 / M_PI)};
  }
  return best;
}

}  // namespace steadyhand
