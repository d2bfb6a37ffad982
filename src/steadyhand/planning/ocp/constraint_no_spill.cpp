#include <array>
#include <cmath>
#include <limits>

#include "steadyhand/planning/ocp/constraints.hpp"

namespace steadyhand {
namespace {

constexpr double kFar = 1e6;  ///< inside the bound, where the liquid does not count

/// sqrt(e_x^2 + e_y^2 + v_x^2 + v_y^2 + eps^2) - room for each mode of each tool's liquid, with e the wave along the
/// glass's axes and v its rate as the height to which it swings. A wave that is below the rim by this measure at a node
/// stays below while the glass moves evenly. Depends only on the liquid's state. The small eps keeps it smooth where
/// there is no wave.
class NoSpill final : public ConstraintFor<NoSpill> {
 public:
  NoSpill(const RobotModel& model, const LiquidSettings& settings)
      : ConstraintFor({"no_spill", "Wave over the rim's margin", "m"}),
        tools_(model.tool_count()),
        price_(settings.price) {}

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return kSloshModes * tools_; }
  Bounds bounds(int /*row*/) const override { return {-std::numeric_limits<double>::infinity(), 0.0}; }
  EntryRange support(int row, int dof) const override {
    const int first = slosh_begin(dof, row / kSloshModes);
    return {first, first + kSloshStates};
  }
  double price(int /*row*/) const override { return price_; }
  double activation_margin(int /*row*/) const override { return 0.5 * kFar; }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    const LiquidInstance& liquid = node.liquid[row / kSloshModes];
    return liquid.counts ? height(wave_at(node, row)) - liquid.room : S(-kFar);
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    const auto wave = wave_at(node, row);
    const S over = scale / height(wave);
    for (const auto& [entry, part, factor] : parts(node, row)) gradient[entry] += over * factor * wave[part];
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, int row, S scale, NodeHessianOf<S>& hessian) const {
    const auto wave = wave_at(node, row);
    const S length = height(wave), over = scale / length, cubed = over / (length * length);
    const auto all = parts(node, row);
    for (std::size_t j = 0; j < all.size(); ++j) {
      for (std::size_t i = 0; i <= j; ++i) {
        const auto &a = all[i], &b = all[j];
        const S same = a.part == b.part ? over : S(0.0);
        hessian(a.entry, b.entry) += a.factor * b.factor * (same - cubed * wave[a.part] * wave[b.part]);
      }
    }
  }

 private:
  /// An entry of z that part `part` of the wave is made of, times `factor`.
  struct Part {
    int entry, part;
    double factor;
  };
  /// In the order of the entries.
  template <typename S>
  static std::array<Part, 6> parts(const NodeOf<S>& node, int row) {
    const int tool = row / kSloshModes, mode = row % kSloshModes;
    const SloshModel& model = node.liquid[tool].model;
    const double c = model.height_by_deflection(), d = model.height_by_force();
    const int begin = slosh_begin(node.arm.dof(), tool);
    const int x = begin + slosh_entry(mode, 0), y = begin + slosh_entry(mode, 1);
    return {{{x, 0, c},
             {x + 1, 2, c},
             {y, 1, c},
             {y + 1, 3, c},
             {begin + slosh_force_entry(0), 0, d},
             {begin + slosh_force_entry(1), 1, d}}};
  }

  template <typename S>
  static std::array<S, 4> wave_at(const NodeOf<S>& node, int row) {
    const int tool = row / kSloshModes;
    return node.liquid[tool].model.template wave<S>(node.slosh[tool], row % kSloshModes);
  }
  template <typename S>
  static S height(const std::array<S, 4>& wave) {
    constexpr double kSmooth = 1e-4;  // m
    using std::sqrt;
    S sum(kSmooth * kSmooth);
    for (const S& part : wave) sum += part * part;
    return sqrt(sum);
  }

  int tools_;
  double price_;
};

/// A row for each tool: the specific force of the interval before along the axis of the glass. A deficit of 1 g costs
/// as much as a wave as high as the radius.
class HeldDown final : public ConstraintFor<HeldDown> {
 public:
  HeldDown(const RobotModel& model, const LiquidSettings& settings)
      : ConstraintFor({"held_down", "Least weight of the liquid", "m/s^2"}),
        tools_(model.tool_count()),
        least_(settings.least_weight * kGravity.z()),
        price_(settings.price * settings.glass.radius / kGravity.z()) {}

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return tools_; }
  Bounds bounds(int /*row*/) const override { return {least_, std::numeric_limits<double>::infinity()}; }
  EntryRange support(int row, int dof) const override {
    const int entry = slosh_begin(dof, row) + slosh_force_entry(2);
    return {entry, entry + 1};
  }
  double price(int /*row*/) const override { return price_; }
  double activation_margin(int /*row*/) const override { return 0.5 * kFar; }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    return node.liquid[row].counts ? node.slosh[row][slosh_force_entry(2)] : S(least_ + kFar);
  }
  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    gradient[slosh_begin(node.arm.dof(), row) + slosh_force_entry(2)] += scale;
  }
  template <typename S>
  void hessian_at(const NodeOf<S>&, int /*row*/, S, NodeHessianOf<S>&) const {}

 private:
  int tools_;
  double least_, price_;
};

}  // namespace

std::shared_ptr<const Constraint> make_no_spill(const RobotModel& model, const OcpSettings& settings) {
  return settings.liquid ? std::make_shared<NoSpill>(model, *settings.liquid) : nullptr;
}

std::shared_ptr<const Constraint> make_held_down(const RobotModel& model, const OcpSettings& settings) {
  return settings.liquid ? std::make_shared<HeldDown>(model, *settings.liquid) : nullptr;
}

}  // namespace steadyhand
