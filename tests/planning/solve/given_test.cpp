#include <gtest/gtest.h>

#include <algorithm>

#include "planning/solve/random_problem.hpp"

namespace steadyhand {
namespace {

constexpr double kGivenTolerance = 1e-6;

/// The joints first .. last - 1.
JointSet joints(int first, int last) {
  JointSet result;
  for (int j = first; j < last; ++j) result.set(j);
  return result;
}

/// Given joints that move in a random way.
void move_given(RandomProblem& problem, JointSet given) {
  problem.instance.given = given;
  for (int k = 0; k < problem.ocp.horizon(); ++k) {
    const JointVector u = random_joints(problem.model.dof(), 1.0, problem.random);
    for (int j = 0; j < problem.model.dof(); ++j)
      if (given[j]) problem.guess.u[k][j] = u[j];
    problem.guess.x[k + 1] = problem.ocp.next(problem.guess.x[k], problem.guess.u[k]);
  }
}

bool keeps_given(const RandomProblem& problem) {
  for (int k = 0; k < problem.ocp.horizon(); ++k) {
    for (int j = 0; j < problem.model.dof(); ++j) {
      if (problem.instance.given[j] && problem.solution.trajectory.u[k][j] != problem.guess.u[k][j]) return false;
    }
  }
  return true;
}

double kkt_error_of(const RandomProblem& problem) {
  Evaluation evaluation(problem.ocp);
  evaluation.set_instance(problem.instance);
  evaluation.set_trajectory(problem.solution.trajectory);
  return kkt_error(evaluation, problem.solution.trajectory, problem.solution.multipliers);
}

/// Of arms that share joints or not, with and without liquid; given are one arm, or any joints.
TEST(Given, StaysAsItIsAndTheRestIsSolvedForAsByAnySolver) {
  for (const bool liquid : {false, true}) {
    int problems = 0, compared = 0;
    std::vector<int> solved(solver_names().size());
    for (unsigned seed = 1; seed <= 12; ++seed) {
      const int shared = static_cast<int>(seed % 3), left = 2 + static_cast<int>(seed % 4);
      RandomProblem problem(shared, left, 5, seed, 8, liquid);
      std::vector<std::unique_ptr<Solver>> solvers;
      for (const std::string& name : solver_names())
        solvers.push_back(*make_solver(name, problem.ocp, kGivenTolerance));
      for (int trial = 0; trial < 3; ++trial, ++problems) {
        problem.draw(0.3, liquid ? 0.5 : 0.8);
        const JointSet some = JointSet(problem.random()) & joints(0, problem.model.dof());
        const JointSet arm = joints(trial == 1 ? shared : 0, shared + left);
        move_given(problem, trial == 0 ? some : arm);
        double objective = NAN;
        for (std::size_t i = 0; i < solvers.size(); ++i) {
          solvers[i]->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
          EXPECT_TRUE(keeps_given(problem)) << solvers[i]->name();
          if (problem.solution.status != SolveStatus::kSolved) continue;
          ++solved[i];
          EXPECT_LT(kkt_error_of(problem), 1e-4) << solvers[i]->name() << ", seed " << seed << ", trial " << trial;
          EXPECT_LT(problem.solution.violation, kGivenTolerance);
          if (std::isnan(objective)) {
            objective = problem.solution.objective;
          } else {  // there may be several minima
            compared += std::abs(problem.solution.objective - objective) <= 1e-5 * (1.0 + std::abs(objective));
          }
        }
      }
    }
    for (std::size_t i = 0; i < solved.size(); ++i) {
      std::cout << solver_names()[i] << ": " << solved[i] << " of " << problems << " solved\n";
      EXPECT_GE(solved[i], problems * (solver_names()[i] == kDefaultSolver ? 97 : 90) / 100);
    }
    std::cout << compared << " with the same objective\n";
    if (solved.size() > 1) {
      EXPECT_GE(compared, problems * 85 / 100);
    }
  }
}

/// The first arm of a tree as one arm, the bodies of the second as bodies of the base where they are at q.
RobotModel first_arm(const RobotModel& tree, const JointVector& q) {
  const int dof = tree.tools[0].link;
  Kinematics at(tree);
  at.set_position(q);
  RobotModel model = tree;
  model.joints.resize(dof);
  model.link_names.resize(dof + 1);
  model.tools.resize(1);
  for (JointVector* each :
       {&model.home, &model.position_min, &model.position_max, &model.velocity_max, &model.acceleration_max})
    each->conservativeResize(dof);
  for (int i = 0; i < std::ssize(model.bodies); ++i) {
    Body& body = model.bodies[i];
    if (body.link <= dof) continue;
    body.link = 0;
    body.origin.translation() = at.body(i).p;
    body.origin.linear() = at.body(i).R;
  }
  std::erase_if(model.pairs, [&](const BodyPair& pair) {
    return model.bodies[pair.first].link == 0 && model.bodies[pair.second].link == 0;
  });
  for (auto& [first, second] : model.pairs)
    if (model.bodies[first].link > model.bodies[second].link) std::swap(first, second);
  return model;
}

/// Next to an arm that is stationary the other one moves as if the bodies of the first were fixed.
TEST(Given, AStationaryArmIsAFixedObstacle) {
  int solved = 0, problems = 0, near = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    RandomProblem both(0, 4, 5, seed);
    both.instance.given = joints(4, 9);
    auto solver = *make_solver(kDefaultSolver, both.ocp, kGivenTolerance);
    for (int trial = 0; trial < 12; ++trial, ++problems) {
      both.draw(0.4);
      solver->solve(both.instance, both.guess, nullptr, {}, both.solution);
      EXPECT_TRUE(keeps_given(both));
      for (const StateVector& x : both.solution.trajectory.x)
        EXPECT_EQ(x.segment(4, 5), both.instance.x0.segment(4, 5));

      const RobotModel model = first_arm(both.model, both.instance.x0.head(9));
      const Ocp ocp(model, RandomProblem::settings(8, false));
      OcpInstance instance = both.instance;
      instance.given.reset();
      instance.x0 = StateVector::Zero(8);
      instance.x0.head(4) = both.instance.x0.head(4);
      for (std::size_t i = 0; i < instance.weights.size(); ++i) {
        instance.weights[i] = both.instance.weights[i].head(ocp.objectives()[i]->weight_count(model)).eval();
      }
      Trajectory guess(4, 8);
      for (StateVector& x : guess.x) x = instance.x0;
      Solution one;
      one.prepare(ocp);
      (*make_solver(kDefaultSolver, ocp, kGivenTolerance))->solve(instance, guess, nullptr, {}, one);
      if (one.status != SolveStatus::kSolved || both.solution.status != SolveStatus::kSolved) continue;
      ++solved;
      for (const int r : one.multipliers.stored()) {
        const bool pair = ocp.constraints()[one.multipliers.row(r).constraint]->name() == "self_collision";
        near += pair && std::abs(*std::min_element(one.multipliers.find(r), one.multipliers.find(r) + 9)) > 1e-3;
      }
      // What both have more than one: the second arm's costs, which are constant.
      const auto above_rest = [](const Ocp& of, const OcpInstance& at, const Trajectory& still, double objective) {
        Evaluation evaluation(of);
        evaluation.set_instance(at);
        evaluation.set_trajectory(still);
        for (int k = 0; k <= of.horizon(); ++k) objective -= evaluation.objective(k);
        return objective;
      };
      const double alone = above_rest(ocp, instance, guess, one.objective);
      EXPECT_NEAR(above_rest(both.ocp, both.instance, both.guess, both.solution.objective), alone,
                  1e-9 * (1.0 + std::abs(both.solution.objective)));
      for (int k = 0; k < 8; ++k) {
        EXPECT_LT((both.solution.trajectory.u[k].head(4) - one.trajectory.u[k]).lpNorm<Eigen::Infinity>(), 1e-3);
      }
    }
  }
  std::cout << solved << " of " << problems << " solved, " << near << " pairs at their bounds\n";
  EXPECT_GE(solved, problems * 9 / 10);
  EXPECT_GT(near, 5);
}

/// Limits and pairs of given joints are nothing that a solver could repair.
TEST(Given, BeyondItsBoundsDoesNotHinderTheRest) {
  for (const std::string& name : solver_names()) {
    int solved = 0, problems = 0;
    for (unsigned seed = 1; seed <= 10; ++seed) {
      RandomProblem problem(0, 4, 5, seed);
      auto solver = *make_solver(name, problem.ocp, kGivenTolerance);
      for (int trial = 0; trial < 4; ++trial, ++problems) {
        problem.draw(0.2);
        move_given(problem, joints(4, 9));
        problem.instance.x0[5] = problem.model.position_max[5] + 0.2;
        problem.instance.x0[9 + 6] = 2.0 * problem.model.velocity_max[6];
        problem.guess.u[3][4] = -2.0 * problem.model.acceleration_max[4];
        solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
        EXPECT_TRUE(keeps_given(problem));
        if (problem.solution.status != SolveStatus::kSolved) continue;  // the arm itself may have hit the other
        ++solved;
        EXPECT_LT(kkt_error_of(problem), 1e-4) << name << ", seed " << seed << ", trial " << trial;
      }
    }
    std::cout << name << ": " << solved << " of " << problems << " solved\n";
    EXPECT_GE(solved, problems * 3 / 4);
  }
}

TEST(Given, AllOfTheJoints) {
  RandomProblem problem(1, 3, 4, 3);
  auto solver = *make_solver(kDefaultSolver, problem.ocp, kGivenTolerance);
  problem.draw(0.3);
  move_given(problem, joints(0, 8));
  solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
  EXPECT_TRUE(keeps_given(problem));
  EXPECT_EQ(problem.solution.status, SolveStatus::kSolved);
}

TEST(Given, OfAJointThatIsNoneIsRefused) {
  RandomProblem problem(0, 2, 3, 1);
  problem.draw(0.3);
  problem.instance.given.set(5);
  EXPECT_EQ(problem.ocp.check(problem.instance).error().message, "joint 5 is given; the joints are 0 to 4");
}

}  // namespace
}  // namespace steadyhand
