#include "steadyhand/planning/solve/realtime/newton_system.hpp"

#include <algorithm>

namespace steadyhand::realtime {

namespace {

/// The arms of a robot, if they share no joint and each one's joints are side by side; else none.
std::vector<JointRange> separate_arms(const RobotModel& model) {
  std::vector<JointRange> arms;
  int next = 0;
  for (int t = 0; t < model.tool_count(); ++t) {
    const std::vector<int> chain = model.chain(model.tools[t].link);
    const int dof = static_cast<int>(chain.size());
    if (chain.front() != next || chain.back() != next + dof - 1) return {};
    arms.push_back({next, dof, t, 1});
    next += dof;
  }
  return next == model.dof() && arms.size() > 1 ? arms : std::vector<JointRange>{};
}

}  // namespace

NewtonSystem::NewtonSystem(const Ocp& ocp) {
  const auto add = [&](const JointRange& joints) {
    parts_.push_back({Riccati(joints, ocp.dof(), ocp.liquid() != nullptr, ocp.horizon(), ocp.dt()), {}, {}, {}});
    for (int i = 0; i < joints.dof; ++i) parts_.back().joints.set(joints.first + i);
  };
  add({0, ocp.dof(), 0, ocp.tool_count()});
  for (const JointRange& arm : separate_arms(ocp.model())) add(arm);
  separate(true);
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
}

}  // namespace steadyhand::realtime
