#include <cmath>
#include <limits>

#include "steadyhand/ocp/constraints.hpp"

namespace steadyhand {
namespace {

/// sqrt(e_x^2 + e_y^2 + eps^2) - room for each mode, with e the wave along the glass's axes. It depends on the liquid's
/// state alone. The small eps keeps it smooth where there is no wave.
class NoSpill final : public ConstraintFor<NoSpill> {
 public:
  explicit NoSpill(const LiquidSettings& settings)
      : ConstraintFor({"no_spill", "Wave over the rim's margin", "m"}), price_(settings.price) {}

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return kSloshModes; }
  Bounds bounds(int /*row*/) const override { return {-std::numeric_limits<double>::infinity(), 0.0}; }
  EntryRange support(int /*row*/, int dof) const override { return {3 * dof, 3 * dof + kSloshStates}; }
  double price(int /*row*/) const override { return price_; }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    const auto [x, y] = node.liquid->model.template wave<S>(*node.slosh, row);
    return height(x, y) - node.liquid->room;
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    const auto [x, y] = node.liquid->model.template wave<S>(*node.slosh, row);
    const S over = scale / height(x, y);
    const SloshModel& model = node.liquid->model;
    const int begin = 3 * node.arm.dof();
    for (int axis = 0; axis < 2; ++axis) {
      const S slope = over * (axis == 0 ? x : y);
      gradient[begin + slosh_entry(row, axis)] += model.height_by_deflection() * slope;
      gradient[begin + slosh_force_entry(axis)] += model.height_by_force() * slope;
    }
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, int row, S scale, NodeHessianOf<S>& hessian) const {
    const auto [x, y] = node.liquid->model.template wave<S>(*node.slosh, row);
    const S length = height(x, y), over = scale / length, cubed = over / (length * length);
    const S xx = over - cubed * x * x, xy = -cubed * x * y, yy = over - cubed * y * y;
    const SloshModel& model = node.liquid->model;
    const int begin = 3 * node.arm.dof();
    const int entries[] = {begin + slosh_entry(row, 0), begin + slosh_entry(row, 1), begin + slosh_force_entry(0),
                           begin + slosh_force_entry(1)};
    const double factors[] = {model.height_by_deflection(), model.height_by_deflection(), model.height_by_force(),
                              model.height_by_force()};
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i <= j; ++i) {
        const S& second = i % 2 != j % 2 ? xy : i % 2 == 0 ? xx : yy;
        hessian(entries[i], entries[j]) += factors[i] * factors[j] * second;
      }
    }
  }

 private:
  template <typename S>
  static S height(const S& x, const S& y) {
    constexpr double kSmooth = 1e-4;  // m
    using std::sqrt;
    return sqrt(x * x + y * y + kSmooth * kSmooth);
  }

  double price_;
};

/// The specific force of the interval before along the axis of the glass. A whole g less is as dear as a wave of the
/// height of the radius.
class HeldDown final : public ConstraintFor<HeldDown> {
 public:
  explicit HeldDown(const LiquidSettings& settings)
      : ConstraintFor({"held_down", "Least weight of the liquid", "m/s^2"}),
        least_(settings.least_weight * kGravity.z()),
        price_(settings.price * settings.glass.radius / kGravity.z()) {}

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return 1; }
  Bounds bounds(int /*row*/) const override { return {least_, std::numeric_limits<double>::infinity()}; }
  EntryRange support(int /*row*/, int dof) const override {
    const int entry = 3 * dof + slosh_force_entry(2);
    return {entry, entry + 1};
  }
  double price(int /*row*/) const override { return price_; }

  template <typename S>
  S value_at(const NodeOf<S>& node, int /*row*/) const {
    return (*node.slosh)[slosh_force_entry(2)];
  }
  template <typename S>
  void gradient_at(const NodeOf<S>& node, int /*row*/, S scale, NodeGradientOf<S>& gradient) const {
    gradient[3 * node.arm.dof() + slosh_force_entry(2)] += scale;
  }
  template <typename S>
  void hessian_at(const NodeOf<S>&, int /*row*/, S, NodeHessianOf<S>&) const {}

 private:
  double least_, price_;
};

}  // namespace

std::shared_ptr<const Constraint> make_no_spill(const RobotModel& /*model*/, const OcpSettings& settings) {
  return settings.liquid ? std::make_shared<NoSpill>(*settings.liquid) : nullptr;
}

std::shared_ptr<const Constraint> make_held_down(const RobotModel& /*model*/, const OcpSettings& settings) {
  return settings.liquid ? std::make_shared<HeldDown>(*settings.liquid) : nullptr;
}

}  // namespace steadyhand
