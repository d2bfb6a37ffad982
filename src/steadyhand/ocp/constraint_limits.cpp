#include "steadyhand/ocp/constraints.hpp"

namespace steadyhand {
namespace {

/// lower <= z_i <= upper for one of the three parts of z: q, dq or u. Row i is joint i.
class Limits final : public ConstraintFor<Limits> {
 public:
  enum Part { kPosition = 0, kVelocity = 1, kAcceleration = 2 };

  Limits(ConstraintInfo info, Part part, JointVector lower, JointVector upper)
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
  /// Those of joints far from their limits need not be looked at.
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

}  // namespace

std::shared_ptr<const Constraint> make_position_limits(const RobotModel& model, const OcpSettings& settings) {
  const JointVector margin =
      settings.position_margin.size() > 0 ? settings.position_margin : JointVector(JointVector::Zero(model.dof()));
  return std::make_shared<Limits>(ConstraintInfo{"position_limits", "Joint limits", "rad"}, Limits::kPosition,
                                  model.position_min + margin, model.position_max - margin);
}

std::shared_ptr<const Constraint> make_velocity_limits(const RobotModel& model, const OcpSettings& settings) {
  const JointVector limit = settings.velocity_scale * model.velocity_max;
  return std::make_shared<Limits>(ConstraintInfo{"velocity_limits", "Speed limits", "rad/s"}, Limits::kVelocity, -limit,
                                  limit);
}

std::shared_ptr<const Constraint> make_acceleration_limits(const RobotModel& model, const OcpSettings& settings) {
  const JointVector limit = settings.acceleration_scale * model.acceleration_max;
  return std::make_shared<Limits>(ConstraintInfo{"acceleration_limits", "Acceleration limits", "rad/s^2"},
                                  Limits::kAcceleration, -limit, limit);
}

}  // namespace steadyhand
