#include "steadyhand/plan/gaps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace steadyhand {

namespace {

/// No point of a body of link j is ever further than this from the origin of joint i < j, m.
LinkPairs levers(const RobotModel& model) {
  const int n = model.dof();
  LinkPairs result = LinkPairs::Zero();
  for (const Body& body : model.bodies) {
    const double reach = body.origin.translation().norm() + body.shape.extent();
    for (int i = 0; i < body.link; ++i) result(i, body.link) = std::max(result(i, body.link), reach);
  }
  for (int j = 1; j <= n; ++j) {
    double length = 0.0;
    for (int i = j - 1; i >= 0; --i) {
      const bool slides = model.joints[i].type == JointType::kPrismatic;
      if (slides) length += std::max(std::abs(model.position_min[i]), std::abs(model.position_max[i]));
      result(i, j) = slides ? 1.0 : result(i, j) + length;  // what a joint that slides moves goes as fast as the joint
      length += model.joints[i].origin.translation().norm();
    }
  }
  return result;
}

/// While the joints are no faster than `speed`, a point of link j accelerates by no more than this as seen from link
/// i, m/s^2. In that frame its acceleration is the sum over joints k and l between them of ddq_k z_k x r_k and of
/// dq_k dq_l z_min(k,l) x (z_max(k,l) x r_max(k,l)), r_k from joint k to the point.
LinkPairs acceleration_bounds(const LinkPairs& levers, const JointVector& speed, const JointVector& acceleration) {
  const int n = static_cast<int>(speed.size());
  LinkPairs bounds = LinkPairs::Zero();
  for (int j = 1; j <= n; ++j) {
    for (int i = 0; i < j; ++i) {
      double before = 0.0;
      for (int k = i; k < j; ++k) {
        bounds(i, j) += levers(k, j) * (acceleration[k] + speed[k] * (speed[k] + 2.0 * before));
        before += speed[k];
      }
    }
  }
  return bounds;
}

}  // namespace

LinkPairs gaps(const Kinematics& kinematics) {
  const RobotModel& model = kinematics.model();
  LinkPairs smallest = LinkPairs::Constant(std::numeric_limits<double>::infinity());
  for (const BodyPair& pair : model.pairs) {
    double& least = smallest(model.bodies[pair.first].link, model.bodies[pair.second].link);
    least = std::min(least, gap(kinematics, pair));
  }
  return smallest;
}

GapsBetween::GapsBetween(Kinematics& kinematics, double smallest)
    : kinematics_(kinematics), levers_(levers(kinematics.model())), smallest_(smallest) {}

bool GapsBetween::stay(const Moment& first, const Moment& last, const JointVector& acceleration, int halvings) {
  const double h = last.t - first.t, s = 0.5 * h;
  const JointVector speed = first.dq.cwiseAbs().cwiseMax(last.dq.cwiseAbs());
  const LinkPairs sag = h * h / 8.0 * acceleration_bounds(levers_, speed, acceleration.cwiseAbs());
  if (halvings == 0 || (first.gaps.min(last.gaps) - sag).minCoeff() >= smallest_) return true;
  Moment middle{first.t + s, first.q + s * first.dq + (0.5 * s * s) * acceleration, first.dq + s * acceleration, {}};
  kinematics_.set_position(middle.q);
  middle.gaps = gaps(kinematics_);
  return middle.gaps.minCoeff() >= smallest_ && stay(first, middle, acceleration, halvings - 1) &&
         stay(middle, last, acceleration, halvings - 1);
}

}  // namespace steadyhand
