#include "sequences.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "steadyhand/files/config/places.hpp"
#include "steadyhand/files/input/recording.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/planning/retarget/retargeter.hpp"

namespace steadyhand::bench {
namespace {

Pose home_pose(const RobotModel& model) {
  Kinematics arm(model);
  arm.set_position(model.home);
  return {arm.p(), Quaternion(arm.R())};
}

Pose moved(const Pose& home, const Vector3& by, const Vector3& turn) {
  const double angle = turn.norm();
  return {home.p + by, angle > 0.0 ? Quaternion(Eigen::AngleAxisd(angle, turn / angle)) * home.q : home.q};
}

/// Sum of sines along each axis, of given peak speed (1/s) around 0.
struct Swing {
  Vector3 amplitude, frequency, phase;

  Swing(double peak_speed, double slowest, double fastest, std::mt19937& random) {
    std::uniform_real_distribution<double> turn(0.0, 2.0 * M_PI), pulse(slowest, fastest);
    for (int i = 0; i < 3; ++i) {
      phase[i] = turn(random);
      frequency[i] = pulse(random);
      amplitude[i] = peak_speed / std::sqrt(3.0) / frequency[i];
    }
  }
  /// 0 at t = 0, fading in over a second.
  Vector3 at(double t) const {
    const double fade = std::min(1.0, t);
    Vector3 result;
    for (int i = 0; i < 3; ++i) result[i] = fade * fade * amplitude[i] * std::sin(frequency[i] * t + phase[i]);
    return result;
  }
};

/// The bundled hand through the retargeter with its defaults, forth and back so that it can go on for ever.
Result<std::pair<TargetPath, double>> recorded(const RobotModel& model) {
  RecordingOptions range;
  range.until = 11.0;
  const auto recording = load_recording(Places::standard().data / "recordings/physics/demo-recording.json", range);
  if (!recording) return recording.error();
  Retargeter retargeter;
  const Pose home = home_pose(model);
  std::vector<Target> targets;
  for (const OperatorSample& sample : recording->samples) targets.push_back(retargeter.update(sample, home));
  const double length = to_seconds(targets.back().stamp.hand - targets.front().stamp.hand);
  const auto path = [targets = std::move(targets), length](double t) {
    const double there = std::fmod(t, 2.0 * length), at = there < length ? there : 2.0 * length - there;
    const Time time = targets.front().stamp.hand + from_seconds(at);
    const auto after = std::find_if(targets.begin() + 1, targets.end() - 1,
                                    [&](const Target& target) { return target.stamp.hand >= time; });
    const Target &a = *(after - 1), &b = *after;
    const double share = to_seconds(time - a.stamp.hand) / to_seconds(b.stamp.hand - a.stamp.hand);
    return Pose{a.X_base_tool.p + share * (b.X_base_tool.p - a.X_base_tool.p),
                a.X_base_tool.q.slerp(share, b.X_base_tool.q)};
  };
  return std::pair<TargetPath, double>(path, 2.0 * length);
}

}  // namespace

Result<std::vector<Sequence>> make_sequences(const RobotModel& model, unsigned seed) {
  std::mt19937 random(seed);
  const Pose home = home_pose(model);
  const auto hand = recorded(model);
  if (!hand) return hand.error();
  const TargetPath& recording = hand->first;

  const Swing slide(0.6, 2.0, 4.0, random), tilt(1.0, 1.0, 3.0, random);
  const TargetPath smooth = [=](double t) { return moved(home, slide.at(t), tilt.at(t)); };
  const Swing rush(2.5, 3.0, 6.0, random), whirl(6.0, 2.0, 5.0, random);
  const double turn = std::uniform_real_distribution<double>(0.0, 2.0 * M_PI)(random);

  std::vector<Sequence> all;
  all.push_back({"recording-20Hz", false, 20.0, 0.0, hand->second, recording});
  all.push_back({"recording-500Hz", false, 500.0, 0.0, hand->second, recording});
  all.push_back({"smooth", false, 500.0, 0.0, 60.0, smooth});
  // Into the base column and the upper arm, and out again.
  all.push_back({"self-collision", true, 500.0, 0.0, 24.0, [=](double t) {
                   const double in = 0.5 - 0.5 * std::cos(2.0 * M_PI * t / 4.0);
                   const Vector3 to(0.08 * std::cos(turn + t / 3.0), 0.08 * std::sin(turn + t / 3.0), 0.35);
                   return moved(home, in * (to - home.p), 0.5 * tilt.at(t));
                 }});
  // Out of reach and around the base, faster than the first joint may turn.
  all.push_back({"limits", true, 500.0, 0.0, 24.0, [=](double t) {
                   const double angle = 2.6 * std::sin(1.6 * t), out = 1.0 + 0.7 * std::sin(0.9 * t);
                   const Vector3 p = Eigen::AngleAxisd(angle, Vector3::UnitZ()) * (out * home.p);
                   return moved(home, p - home.p, whirl.at(t));
                 }});
  all.push_back({"rush", true, 500.0, 0.0, 60.0, [=](double t) { return moved(home, rush.at(t), whirl.at(t)); }});
  all.push_back({"jumps", true, 500.0, 0.0, 60.0, [=](double t) {
                   std::mt19937 draw(seed + static_cast<unsigned>(t / 0.7));
                   std::normal_distribution<double> normal;
                   const Vector3 to(normal(draw), normal(draw), normal(draw));
                   return moved(home, t < 0.7 ? Vector3::Zero().eval() : (0.3 * to.normalized()).eval(),
                                Vector3::Zero());
                 }});
  all.push_back({"noisy-x0", true, 500.0, 1e-3, 60.0, smooth});
  return all;
}

Obstacles make_obstacles(const RobotModel& model, int count, unsigned seed) {
  constexpr double kAway = 0.05;  // m
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0), size(0.02, 0.15);
  Kinematics arm(model);
  arm.set_position(model.home);
  const auto is_away = [&](const Obstacle& obstacle) {
    for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) {
      if (model.bodies[i].link > 0 && gap(arm, i, obstacle.shape, obstacle.at) < kAway) return false;
    }
    return true;
  };
  Obstacles obstacles;
  while (obstacles.count < count) {
    Obstacle& obstacle = obstacles.list[obstacles.count];
    if (obstacles.count == 0) {
      obstacle.shape = Shape::half_space();
      obstacle.at = {{0.0, 0.0, -0.02}, Matrix3::Identity()};
    } else {
      const Shape shapes[] = {Shape::box({size(random), size(random), size(random)}, 0.01),
                              Shape::capsule(size(random), size(random)), Shape::sphere(size(random))};
      const Vector3 axis = Vector3(unit(random), unit(random), unit(random)).normalized();
      obstacle.shape = shapes[random() % std::size(shapes)];
      obstacle.at = {{unit(random), unit(random), 0.5 + 0.5 * unit(random)},
                     Eigen::AngleAxisd(M_PI * unit(random), axis).toRotationMatrix()};
    }
    obstacles.count += obstacles.count == 0 || is_away(obstacle);
  }
  return obstacles;
}

}  // namespace steadyhand::bench
