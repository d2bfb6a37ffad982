#include "steadyhand/planning/solve/realtime/newton_system.hpp"

#include <algorithm>

namespace steadyhand::realtime {

namespace {

/// The joints that move only one tool, of each, if they are side by side; else none.
std::vector<JointRange> separate_arms(const RobotModel& model) {
  std::vector<int> tools(model.dof(), 0);  // how many a joint moves
  for (const Tool& tool : model.tools)
    for (const int k : model.chain(tool.link)) ++tools[k];
  std::vector<JointRange> arms;
  for (int t = 0; model.tool_count() > 1 && t < model.tool_count(); ++t) {
    std::vector<int> own = model.chain(model.tools[t].link);
    std::erase_if(own, [&](int k) { return tools[k] > 1; });
    const int dof = static_cast<int>(own.size());
    if (dof == 0 || own.back() != own.front() + dof - 1) return {};
    arms.push_back({own.front(), dof, t, 1});
  }
  return arms;
}

}  // namespace

NewtonSystem::NewtonSystem(const Ocp& ocp) {
  parts_.reserve(1 + kMaxTools);  // a copy would lose the memory that ModelLayout has reserved
  const auto add = [&](const JointRange& joints) {
    parts_.push_back({Riccati(joints, ocp.dof(), ocp.liquid() != nullptr, ocp.horizon(), ocp.dt()), {}, {}, {}});
    for (int i = 0; i < joints.dof; ++i) parts_.back().joints.set(joints.first + i);
  };
  add({0, ocp.dof(), 0, ocp.tool_count()});
  for (const JointRange& arm : separate_arms(ocp.model())) add(arm);
  shared_ = parts_[0].joints;
  for (const Part& part : std::span(parts_).subspan(1)) shared_ &= ~part.joints;
  set_given({});
}

void NewtonSystem::set_sources(const Riccati::Steps& steps, const NodeHessianOf<Lanes>& H,
                               const NodeGradientOf<Lanes>& g, const NodeHessianOf<Lanes>& slosh) {
  if (set_ && steps == steps_) return;
  steps_ = steps;
  set_ = true;
  for (Part& part : parts_) {
    part.riccati.use_slosh(steps);
    part.model.set(part.riccati, H, &g);
    part.slosh.set(part.riccati, slosh, nullptr);
  }
}

void NewtonSystem::set_given(JointSet given) {
  shared_moves_ = (shared_ & ~given).any();
  for (Part& part : parts_) part.is_given = (part.joints & ~given).none();
}

bool NewtonSystem::couples(const NodeHessianOf<Lanes>& H) const {
  for (std::size_t a = 1; a < parts_.size(); ++a) {
    for (std::size_t b = a + 1; b < parts_.size(); ++b) {
      for (const int i : parts_[a].riccati.entries()) {
        for (const int j : parts_[b].riccati.entries()) {
          const Lanes& entry = H(std::min(i, j), std::max(i, j));
          if (any(entry < 0.0) || any(entry > 0.0)) return true;
        }
      }
    }
  }
  return false;
}

bool NewtonSystem::factorise(double smallest_pivot) {
  return std::ranges::all_of(parts(),
                             [&](Part& part) { return part.is_given || part.riccati.factorise(smallest_pivot); });
}

void NewtonSystem::solve(NodeTable& step) {
  for (const Part& part : parts()) {
    if (!part.is_given) {
      part.riccati.solve(step);
      continue;
    }
    for (const int i : part.riccati.entries()) std::fill_n(step[i], step.batches(), Lanes(0.0));
  }
  const int n = parts_[0].riccati.joints().dof;
  for (int i = 0; is_separate() && i < 3 * n; ++i)
    if (shared_[i % n]) std::fill_n(step[i], step.batches(), Lanes(0.0));
}

}  // namespace steadyhand::realtime
