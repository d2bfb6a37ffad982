#pragma once

#include <array>
#include <span>
#include <vector>

#include "steadyhand/planning/ocp/ocp.hpp"
#include "steadyhand/planning/solve/realtime/model_layout.hpp"
#include "steadyhand/planning/solve/realtime/riccati.hpp"

namespace steadyhand::realtime {

/// The Newton step of the whole problem or, while nothing couples its arms, of each arm by itself: as exact, and n^3
/// cheaper. Joints that arms share couple them, unless they are given. The constructor allocates all memory.
class NewtonSystem {
 public:
  /// One recursion, and where it finds its numbers in batches of nodes.
  struct Part {
    Riccati riccati;
    ModelLayout model;  ///< of H and g by z
    ModelLayout slosh;  ///< of second derivatives by [q; dq; u]
    JointSet joints;
    bool is_given = false;  ///< its step is 0, and its models are not read
  };

  explicit NewtonSystem(const Ocp& ocp);

  /// The liquids' steps (Riccati::use_slosh), and where the models come from, see Part; z has entries of the liquids if
  /// there are steps. Does nothing if the steps are the same as before.
  void set_sources(const Riccati::Steps& steps, const NodeHessianOf<Lanes>& H, const NodeGradientOf<Lanes>& g,
                   const NodeHessianOf<Lanes>& slosh);
  /// Joints that do not move, see OcpInstance; of others in one recursion the models must have no derivatives by them
  /// except a positive curvature by their accelerations.
  void set_given(JointSet given);
  /// Whether the arms are solved by themselves, if they share no joint that is not given. Default: true.
  void separate(bool on) { separate_ = on; }
  bool is_separate() const { return separate_ && parts_.size() > 1 && !shared_moves_; }
  /// Whether this Hessian by z has an entry that couples joints of different arms.
  bool couples(const NodeHessianOf<Lanes>& H) const;
  /// Whose models are to be filled: all of the arms, or each.
  std::span<Part> parts() { return is_separate() ? std::span(parts_).subspan(1) : std::span(parts_).first(1); }

  /// See Riccati.
  bool factorise(double smallest_pivot);
  void solve(NodeTable& step);

 private:
  std::vector<Part> parts_;  ///< the whole, then its arms if it has several, without the joints that they share
  JointSet shared_;
  bool separate_ = true, shared_moves_ = false, set_ = false;
  Riccati::Steps steps_{};
};

}  // namespace steadyhand::realtime
