#include "steadyhand/pipeline/pipeline.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

constexpr double kUnitTolerance = 1e-3;  ///< of a quaternion's length

}  // namespace

PredictorSettings complete(PredictorSettings predictor, const OcpSettings& ocp, const Reach& reach) {
  predictor.horizon = ocp.horizon;
  predictor.dt = ocp.dt;
  predictor.reach_center = reach.center;
  predictor.reach = reach.radius;
  return predictor;
}

PipelineSettings::PipelineSettings(const Profile& profile) : ocp(profile.ocp) {
  planner.solver = profile.solver;
  planner.tolerance = profile.tolerance;
}

Result<std::unique_ptr<Pipeline>> Pipeline::make(const std::string& robot, const std::string& profile,
                                                 const Places& places) {
  Result<RobotModel> model = open_robot(robot, places);
  if (!model) return model.error();
  const Result<Profile> settings = load_profile(profile, places);
  if (!settings) return settings.error();
  return make(*std::move(model), PipelineSettings(*settings));
}

Result<std::unique_ptr<Pipeline>> Pipeline::make(RobotModel model, const PipelineSettings& settings) {
  if (!(settings.rate_hz > 0.0) || settings.rate_hz > 1e4)
    return Error{fmt::format("rate is {} Hz; it must be above 0, to 1e4", settings.rate_hz)};
  if (!(settings.retarget.scale > 0.0) || !std::isfinite(settings.retarget.scale) ||
      !std::isfinite(settings.retarget.yaw))
    return Error{fmt::format("scale is {} and yaw {} rad; both must be finite, the scale above 0",
                             settings.retarget.scale, settings.retarget.yaw)};
  auto owned = std::make_unique<const RobotModel>(std::move(model));
  auto planner = Planner::make(*owned, settings.ocp, settings.planner);
  if (!planner) return planner.error();
  return std::unique_ptr<Pipeline>(new Pipeline(std::move(owned), settings, *std::move(planner)));
}

Pipeline::Pipeline(std::unique_ptr<const RobotModel> model, const PipelineSettings& settings,
                   std::unique_ptr<Planner> planner)
    : model_(std::move(model)),
      period_(from_seconds(1.0 / settings.rate_hz)),
      retargeter_(settings.retarget),
      predictor_(complete(settings.predictor, settings.ocp, compute_reach(*model_))),
      planner_(std::move(planner)),
      tracker_(model_->home),
      arm_(*model_) {}

Status Pipeline::feed(const OperatorSample& sample) {
  const Pose& hand = sample.X_operator_hand;
  if (sample.tracked &&
      (!hand.p.allFinite() || !hand.q.coeffs().allFinite() || std::abs(hand.q.norm() - 1.0) > kUnitTolerance)) {
    return Error{
        fmt::format("the hand is at [{}, {}, {}] m, turned by the quaternion [{}, {}, {}, {}]; numbers must be "
                    "finite and the quaternion of length 1",
                    hand.p.x(), hand.p.y(), hand.p.z(), hand.q.x(), hand.q.y(), hand.q.z(), hand.q.w())};
  }
  fed_ = true;
  arm_.set_position(tracker_.update(sample.stamp.hand).q);
  target_ = retargeter_.update(sample, {arm_.p(), Quaternion(arm_.R())});
  predictor_.update(target_);
  return Done{};
}

const Plan& Pipeline::plan(Time now) {
  const Plan& plan = planner_->update(predictor_.predict(now));
  tracker_.follow(plan);
  return plan;
}

JointCommand Pipeline::update(Time now) {
  now = newest_ = std::max(now, newest_);
  if (fed_ && (!planned_ || now >= next_plan_)) {
    plan(now);
    // In step with the first plan; after a pause what was missed is not made up for.
    next_plan_ = planned_ && now < next_plan_ + period_ ? next_plan_ + period_ : now + period_;
    planned_ = true;
  }
  return tracker_.update(now);
}

Status Pipeline::reset(const JointVector& q, Time now) {
  const RobotModel& model = *model_;
  const bool fits = q.size() == model.dof() && q.allFinite() && (q.array() >= model.position_min.array()).all() &&
                    (q.array() <= model.position_max.array()).all();
  if (!fits) {
    return Error{fmt::format("the joints are to be reset to [{}]; {} numbers inside the arm's limits are expected",
                             fmt::join(q.begin(), q.end(), ", "), model.dof())};
  }
  planner_->reset(q, now);
  tracker_.follow(planner_->plan());
  retargeter_.release();
  newest_ = now;
  fed_ = planned_ = false;
  return Done{};
}

}  // namespace steadyhand
