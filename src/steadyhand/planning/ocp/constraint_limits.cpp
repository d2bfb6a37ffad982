#include "steadyhand/planning/ocp/constraints.hpp"

namespace steadyhand {
namespace {

/// rad (m): room that a joint at its limit is assumed to have, so that rounding errors cause no hard braking.
/// The check of plans tolerates ten times as much.
constexpr double kLeastRoom = 1e-6;
constexpr double kNarrowest = 1e-4;  ///< share of a limit that a narrowed range keeps

/// lower <= z_i <= upper for one of the three parts of z: q, dq or u. Row i is joint i.
class StateLimits : public ConstraintFor<StateLimits> {
 public:
  enum Part { kPosition = 0, kVelocity = 1, kAcceleration = 2 };

  StateLimits(ConstraintInfo info, Part part, JointVector lower, JointVector upper)
      : ConstraintFor(std::move(info)), part_(part), lower_(std::move(lower)), upper_(std::move(upper)) {}

  Nodes nodes() const override { return part_ == kAcceleration ? Nodes::kIntervals : Nodes::kStates; }
  int rows() const override { return static_cast<int>(lower_.size()); }
  Bounds bounds(int row) const override { return {lower_[row], upper_[row]}; }

  int entry(int row) const override { return part_ * rows() + row; }

  void find_near(const NodeBatch& nodes, Lanes acts, char* near) const override {
    for (int i = 0; i < rows(); ++i) {
      const Lanes v = value_at<Lanes>(nodes, i), inside = min(v - lower_[i], upper_[i] - v);
      if (any(select(acts > 0.0, inside - activation_margin(i), 0.0) < 0.0)) near[i] = 1;
    }
  }
  /// Rows of joints far from their limits need no check.
  double activation_margin(int row) const override { return kFar * (upper_[row] - lower_[row]); }

  EntryRange support(int row, int /*dof*/) const override { return {entry(row), entry(row) + 1}; }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    return part_ == kPosition ? node.arm.q()[row] : part_ == kVelocity ? node.dq[row] : node.u[row];
  }
  template <typename S>
  void gradient_at(const NodeOf<S>& /*node*/, int row, S scale, NodeGradientOf<S>& gradient) const {
    gradient[entry(row)] += scale;
  }
  template <typename S>
  void hessian_at(const NodeOf<S>& /*node*/, int /*row*/, S /*scale*/, NodeHessianOf<S>& /*hessian*/) const {}

 private:
  static constexpr double kFar = 0.1;  ///< share of the range

  Part part_;
  JointVector lower_, upper_;
};

/// The limits of accelerations, narrowed at node 0 so that no joint passes its position limit within the first
/// interval. At the nodes the margins ensure this; x_0 may be nearer.
class AccelerationLimits final : public StateLimits {
 public:
  AccelerationLimits(ConstraintInfo info, const RobotModel& model, const OcpSettings& settings)
      : StateLimits(std::move(info), kAcceleration, -settings.acceleration_scale * model.acceleration_max,
                    settings.acceleration_scale * model.acceleration_max),
        model_(model),
        dt_(settings.dt),
        looks_between_nodes_(settings.position_margin.size() > 0) {}

  Bounds first_bounds(const StateVector& x0, int row) const override {
    Bounds result = bounds(row);
    if (!looks_between_nodes_) return result;
    const double q = x0[row], dq = x0[rows() + row], most = model_.acceleration_max[row];
    // The limit ahead, seen in the direction of motion: what is narrowed is the upper bound, or the mirror's.
    const double room = std::max(0.0, dq > 0.0 ? model_.position_max[row] - q : q - model_.position_min[row]);
    if (2.0 * room >= std::abs(dq) * dt_) return result;  // not passed before node 1, which has its own limits
    const double brake = std::min(dq * dq / (2.0 * (room + kLeastRoom)), (1.0 - kNarrowest) * most);
    const double least = std::min(brake + kNarrowest * most, most);  // the scaled limit gives way where it must
    if (dq > 0.0) return {std::min(result.lower, -least), std::min(result.upper, -brake)};
    return {std::max(result.lower, brake), std::max(result.upper, least)};
  }

 private:
  const RobotModel& model_;
  double dt_;
  bool looks_between_nodes_;
};

}  // namespace

std::shared_ptr<const Constraint> make_position_limits(const RobotModel& model, const OcpSettings& settings) {
  const JointVector margin =
      settings.position_margin.size() > 0 ? settings.position_margin : JointVector(JointVector::Zero(model.dof()));
  return std::make_shared<StateLimits>(ConstraintInfo{"position_limits", "Joint limits", "rad"}, StateLimits::kPosition,
                                       model.position_min + margin, model.position_max - margin);
}

std::shared_ptr<const Constraint> make_velocity_limits(const RobotModel& model, const OcpSettings& settings) {
  const JointVector limit = settings.velocity_scale * model.velocity_max;
  return std::make_shared<StateLimits>(ConstraintInfo{"velocity_limits", "Speed limits", "rad/s"},
                                       StateLimits::kVelocity, -limit, limit);
}

std::shared_ptr<const Constraint> make_acceleration_limits(const RobotModel& model, const OcpSettings& settings) {
  return std::make_shared<AccelerationLimits>(ConstraintInfo{"acceleration_limits", "Acceleration limits", "rad/s^2"},
                                              model, settings);
}

}  // namespace steadyhand
