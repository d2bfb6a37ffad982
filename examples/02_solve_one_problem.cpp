// States one optimal control problem, solves it, and shows the plan and what each term adds to the objective.
#include <fmt/format.h>

#include <cstdio>

#include "steadyhand/files.hpp"
#include "steadyhand/planning.hpp"

using namespace steadyhand;

int main() {
  const Result<RobotModel> ur5e = open_robot("ur5e");
  const Result<Profile> profile = load_profile("anti-slosh");
  if (!ur5e || !profile) {
    fmt::print(stderr, "{}\n", ur5e ? profile.error().message : ur5e.error().message);
    return 2;
  }
  const Ocp ocp(*ur5e, profile->ocp);
  auto solver = make_solver(profile->solver, ocp, profile->tolerance);
  auto weights = ocp.weights(profile->ocp.weights);
  if (!solver || !weights) return 2;

  // The arm rests at home; the hand moves sideways at 0.3 m/s and keeps the glass as it is.
  Kinematics arm(*ur5e);
  arm.set_position(ur5e->home);
  OcpInstance instance;
  instance.x0 = StateVector::Zero(2 * ocp.dof());
  instance.x0.head(ocp.dof()) = ur5e->home;
  instance.weights = *weights;
  instance.reference.nodes = ocp.horizon();
  for (int k = 1; k <= ocp.horizon(); ++k) {
    instance.reference.tools[0].p[k - 1] = arm.p() + Vector3(0.0, 0.3 * k * ocp.dt(), 0.0);
    instance.reference.tools[0].R[k - 1] = arm.R();
  }

  Trajectory guess(ocp.dof(), ocp.horizon());  // standing still
  for (StateVector& x : guess.x) x = instance.x0;
  Solution solution;
  solution.prepare(ocp);  // takes the memory; solve() writes into it
  (*solver)->solve(instance, guess, nullptr, SolveBudget{}, solution);
  fmt::print("{}: {} after {} iterations, objective {:.5f}, KKT error {:.1e}\n", (*solver)->name(),
             to_string(solution.status), solution.iterations, solution.objective, solution.kkt_error);

  Evaluation evaluation(ocp);
  evaluation.set_instance(instance);
  evaluation.set_trajectory(solution.trajectory);
  double sum = 0.0;
  for (int i = 0; i < std::ssize(ocp.objectives()); ++i) {
    sum += evaluation.objective_share(i);
    fmt::print("  {:<13}{:.5f}\n", ocp.objectives()[i]->name(), evaluation.objective_share(i));
  }
  fmt::print("  t_s  glass_y_m  hand_y_m  lateral_m_s2\n");
  for (int k = 0; k < ocp.horizon(); ++k) {
    const double lateral = evaluation.arm(k).local_acceleration().head<2>().norm();
    fmt::print("  {:.2f}  {:9.4f}  {:8.4f}  {:12.3f}\n", k * ocp.dt(), evaluation.arm(k).p().y(),
               arm.p().y() + 0.3 * k * ocp.dt(), lateral);
  }
  const bool right = solution.status == SolveStatus::kSolved && evaluation.violation() < 1e-6 &&
                     std::abs(sum - solution.objective) < 1e-9 * (1.0 + sum);
  return right ? 0 : 1;
}
