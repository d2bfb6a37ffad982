#include "steadyhand/apps/browser/closed_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "steadyhand/apps/browser/browser_session.hpp"
#include "steadyhand/core/json_writer.hpp"
#include "steadyhand/planning/plan/planner.hpp"

namespace steadyhand {

Result<std::string> closed_loop(const BrowserSetup& setup, int profile, int problems,
                                const std::function<Time()>& wall) {
  constexpr int kEach = 20;       // plans along one hand
  constexpr double kStep = 0.02;  // s from one to the next
  if (profile < 0 || profile >= std::ssize(setup.profiles))
    return Error{fmt::format("there is no profile {}", profile)};
  const Profile& chosen = setup.profiles[static_cast<std::size_t>(profile)];
  PlannerSettings settings;
  settings.solver = chosen.solver;
  settings.tolerance = chosen.tolerance;
  auto planner = Planner::make(setup.robot, chosen.ocp, settings);
  if (!planner) return planner.error();
  Kinematics arm(setup.robot);
  arm.set_position(setup.robot.home);
  std::mt19937 random(19);  // its numbers, unlike those of distributions, are the same with every library
  const auto uniform = [&](double low, double high) { return low + (high - low) * 0x1p-32 * random(); };
  Reference reference;
  reference.dt = chosen.ocp.dt;
  reference.nodes = chosen.ocp.horizon;
  JsonBuffer text;
  JsonWriter json(text);
  std::vector<double> times;
  json.begin_object();
  json.key("plans");
  json.begin_array();
  Vector3 extent, speed;
  double lean = 0.0;
  for (int i = 0; i < problems; ++i) {
    if (i % kEach == 0) {
      (*planner)->reset(setup.robot.home, from_seconds(kStep * i));
      for (double& each : extent) each = uniform(0.05, 0.35);
      for (double& each : speed) each = uniform(0.5, 3.0);
      lean = uniform(0.0, 0.4);
    }
    const double begin = kStep * (i % kEach);
    reference.start = from_seconds(kStep * i);
    for (int k = 0; k < reference.nodes; ++k) {
      const Vector3 phase = (begin + (k + 1) * reference.dt) * speed;
      for (int t = 0; t < arm.tool_count(); ++t) {
        reference.tools[t].p[k] = arm.p(t) + extent.cwiseProduct(Vector3(phase.array().sin()));
        reference.tools[t].R[k] = arm.R(t) * Eigen::AngleAxisd(lean * std::sin(phase.x()), Vector3::UnitY());
      }
    }
    const Time before = wall();
    const Plan& plan = (*planner)->update(reference);
    times.push_back(1e6 * to_seconds(wall() - before));
    std::vector<double> numbers;
    for (int k = 0; k <= plan.intervals; ++k) {
      numbers.insert(numbers.end(), plan.x[k].begin(), plan.x[k].begin() + 2 * plan.joints);
    }
    json.value(numbers);
  }
  json.end_array();
  json.member("times_us", times);
  json.end_object();
  return text;
}

Result<std::string> commands_of(BrowserSetup setup, double seconds) {
  constexpr double kRate = 50.0;  // Hz
  auto session = BrowserSession::make(std::move(setup), {}, kRate);
  if (!session) return session.error();
  JsonBuffer text;
  JsonWriter json(text);
  json.begin_object();
  json.key("commands");
  json.begin_array();
  (*session)->on_command = [&](const JointCommand& command) {
    std::vector<double> numbers(command.q.begin(), command.q.end());
    numbers.insert(numbers.end(), command.dq.begin(), command.dq.end());
    json.value(numbers);
  };
  constexpr double kTurn = 0.1;  // s, less than a pause
  for (int i = 0; kTurn * i <= seconds; ++i) (*session)->advance(from_seconds(kTurn * i));
  json.end_array();
  json.end_object();
  return text;
}

}  // namespace steadyhand
