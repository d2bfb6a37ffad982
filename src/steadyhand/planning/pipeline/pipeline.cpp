#include "steadyhand/planning/pipeline/pipeline.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/geometry/robot/model_check.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"
#include "steadyhand/planning/pipeline/complete.hpp"

namespace steadyhand {

namespace {

constexpr double kUnitTolerance = 1e-3;     ///< for a quaternion's norm
constexpr double kSlowest = 1e-3;           ///< Hz
constexpr double kLongestLookAhead = 10.0;  ///< s
const Time kFarthest = from_seconds(9e9);   ///< from the epoch: what is planned from here on still is a Time

bool is_near(Time t) { return t <= kFarthest && t >= -kFarthest; }

Status check_numbers(const RobotModel& model, const PipelineSettings& settings) {
  const RetargetSettings& retarget = settings.retarget;
  if (!(settings.rate_hz >= kSlowest) || settings.rate_hz > 1e4)
    return Error{fmt::format("rate is {} Hz; it must be from {} to 1e4", settings.rate_hz, kSlowest)};
  if (!(retarget.scale > 0.0) || !std::isfinite(retarget.scale) || !std::isfinite(retarget.yaw))
    return Error{fmt::format("scale is {} and yaw {} rad; both must be finite, the scale above 0", retarget.scale,
                             retarget.yaw)};
  if (!(retarget.ramp >= 0.0) || !std::isfinite(retarget.ramp))
    return Error{fmt::format("ramp is {} s; it must be finite, at least 0", retarget.ramp)};
  for (const auto& [key, value] :
       {std::pair("window", settings.predictor.window), std::pair("max_gap", settings.predictor.max_gap)}) {
    if (!(value > 0.0) || !std::isfinite(value))
      return Error{fmt::format("{} of the predictor is {} s; it must be finite, above 0", key, value)};
  }
  for (int k = 0; k < model.dof(); ++k) {
    if (model.position_min[k] <= model.home[k] && model.home[k] <= model.position_max[k]) continue;
    return Error{fmt::format("robot '{}': home[{}] = {} is outside the limits {} to {} of joint '{}'", model.name, k,
                             model.home[k], model.position_min[k], model.position_max[k], model.joints[k].name)};
  }
  return Done{};
}

}  // namespace

PipelineSettings::PipelineSettings(const Profile& profile) { apply(profile, retarget, predictor, ocp, planner); }

Result<std::unique_ptr<Pipeline>> Pipeline::make(RobotModel model, const PipelineSettings& settings) {
  if (Status s = check(model); !s) return s.error();
  if (Status s = check_numbers(model, settings); !s) return s.error();
  auto owned = std::make_unique<const RobotModel>(std::move(model));
  auto planner = Planner::make(*owned, settings.ocp, settings.planner);
  if (!planner) return planner.error();
  return std::unique_ptr<Pipeline>(new Pipeline(std::move(owned), settings, *std::move(planner)));
}

Pipeline::Pipeline(std::unique_ptr<const RobotModel> model, const PipelineSettings& settings,
                   std::unique_ptr<Planner> planner)
    : model_(std::move(model)),
      period_(from_seconds(1.0 / settings.rate_hz)),
      planner_(std::move(planner)),
      tracker_(model_->home),
      arm_(*model_) {
  for (int t = 0; t < model_->tool_count(); ++t) {
    hands_.push_back({Retargeter(settings.retarget),
                      Predictor(complete(settings.predictor, settings.ocp, compute_reach(*model_, t)))});
  }
}

Status Pipeline::feed(const OperatorSample& sample) {
  const Pose& hand = sample.X_operator_hand;
  if (sample.tracked &&
      (!hand.p.allFinite() || !hand.q.coeffs().allFinite() || std::abs(hand.q.norm() - 1.0) > kUnitTolerance)) {
    return Error{
        fmt::format("the hand is at [{}, {}, {}] m, turned by the quaternion [{}, {}, {}, {}]; numbers must be "
                    "finite and the quaternion of length 1",
                    hand.p.x(), hand.p.y(), hand.p.z(), hand.q.x(), hand.q.y(), hand.q.z(), hand.q.w())};
  }
  if (!is_near(sample.stamp.hand) || !is_near(sample.stamp.made)) {
    return Error{fmt::format("the hand's times are {:.0f} s and {:.0f} s; they must be within 9e9 s of the epoch",
                             to_seconds(sample.stamp.hand), to_seconds(sample.stamp.made))};
  }
  if (const double ahead = to_seconds(sample.look_ahead); std::abs(ahead) > kLongestLookAhead) {
    return Error{
        fmt::format("the hand's pose is predicted {:.0f} s ahead; at most {} s can be", ahead, kLongestLookAhead)};
  }
  if (sample.tool < 0 || sample.tool >= model_->tool_count()) {
    return Error{fmt::format("the hand moves tool {}; robot '{}' has {} tool{}, counted from 0", sample.tool,
                             model_->name, model_->tool_count(), model_->tool_count() == 1 ? "" : "s")};
  }
  fed_ = true;
  arm_.set_position(tracker_.update(sample.stamp.hand).q);
  OperatorSample followed = sample;
  if (sample.tracked) followed.X_operator_hand.q.normalize();
  Hand& by = hands_[sample.tool];
  if (hands_.size() > 1 && !any_follows()) {  // from now on they may hold one thing
    const Pose first{arm_.p(0), Quaternion(arm_.R(0))}, second{arm_.p(1), Quaternion(arm_.R(1))};
    X_tool_tool_ = first.inverse() * second;
    planner_->set_held(X_tool_tool_);
  }
  by.target = by.retargeter.update(followed, {arm_.p(sample.tool), Quaternion(arm_.R(sample.tool))});
  by.predictor.update(by.target);
  return Done{};
}

/// Of all tools. A tool whose hand was never seen stays where it is.
Reference Pipeline::predict(Time now) {
  Reference all = hands_[0].predictor.predict(now);
  PerTool<bool> known{all.nodes > 0};
  for (std::size_t t = 1; t < hands_.size(); ++t) {
    const Reference one = hands_[t].predictor.predict(now);
    known[t] = one.nodes > 0;
    if (!known[t]) continue;
    all.stamp.hand = known[0] ? std::max(all.stamp.hand, one.stamp.hand) : one.stamp.hand;
    all.nodes = one.nodes;
    all.tools[t] = one.tools[0];
  }
  arm_.set_position(tracker_.update(now).q);
  if (any_follows() && holds_one_thing()) {  // a tool without a hand goes with the other
    for (std::size_t t = 0; t < hands_.size(); ++t) {
      if (hands_[t].predictor.newest().engaged) continue;
      const ToolReference& leader = all.tools[1 - t];
      const Pose X_leader_tool = t == 1 ? X_tool_tool_ : X_tool_tool_.inverse();
      for (int k = 0; k < all.nodes; ++k) {
        all.tools[t].p[k] = leader.p[k] + leader.R[k] * X_leader_tool.p;
        all.tools[t].R[k] = leader.R[k] * X_leader_tool.q.toRotationMatrix();
      }
    }
    return all;
  }
  for (std::size_t t = 0; t < hands_.size() && all.nodes > 0; ++t) {
    if (known[t]) continue;
    all.tools[t].p.fill(arm_.p(static_cast<int>(t)));
    all.tools[t].R.fill(arm_.R(static_cast<int>(t)));
  }
  return all;
}

/// While a tool follows, joints that move others are held still once they are slow.
void Pipeline::hold_others(const JointCommand& at_start) {
  constexpr double kSlow = 0.02;  // rad/s (m/s)
  std::bitset<kMaxJoints> given;
  for (std::size_t t = 0; t < hands_.size() && any_follows() && !holds_one_thing(); ++t) {
    const std::vector<int>& chain = arm_.chain(static_cast<int>(t));
    if (hands_[t].predictor.newest().engaged) continue;
    const bool slow = std::ranges::all_of(chain, [&](int k) { return std::abs(at_start.dq[k]) < kSlow; });
    for (const int k : chain) given[k] = given[k] || slow;
  }
  planner_->set_given(given);
}

bool Pipeline::holds_one_thing() const {
  const Objectives& objectives = planner_->ocp().objectives();
  const auto tie = std::ranges::find_if(objectives, [](const auto& each) { return each->info().ties_tools; });
  return tie != objectives.end() && planner_->instance().weights[tie - objectives.begin()].maxCoeff() > 0.0;
}

bool Pipeline::any_follows() const {
  return std::ranges::any_of(hands_, [](const Hand& hand) { return hand.predictor.newest().engaged; });
}

const Plan& Pipeline::plan(Time now) {
  if (hands_.size() > 1) hold_others(tracker_.update(std::clamp(now, -kFarthest, kFarthest)));
  const Plan& plan = planner_->update(predict(std::clamp(now, -kFarthest, kFarthest)));
  tracker_.follow(plan);
  return plan;
}

JointCommand Pipeline::update(Time now) {
  now = newest_ = std::max(std::clamp(now, -kFarthest, kFarthest), newest_);
  if (fed_ && (!planned_ || now >= next_plan_)) {
    plan(now);
    // In step with the first plan; plans missed in a pause are skipped.
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
  if (!is_near(now)) {
    return Error{
        fmt::format("the joints are to be reset at {:.0f} s; it must be within 9e9 s of the epoch", to_seconds(now))};
  }
  planner_->reset(q, now);
  tracker_.follow(planner_->plan());
  for (Hand& hand : hands_) {
    hand.retargeter.release();
    hand.predictor.forget();
  }
  newest_ = now;
  fed_ = planned_ = false;
  return Done{};
}

}  // namespace steadyhand
