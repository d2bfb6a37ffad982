#pragma once

#include <memory>
#include <vector>

#include "steadyhand/ocp/settings.hpp"
#include "steadyhand/ocp/term.hpp"

namespace steadyhand {

// Each has a file of its own, constraint_NAME.cpp. The model must outlive the constraint.
std::unique_ptr<Constraint> make_position_limits(const RobotModel& model);
std::unique_ptr<Constraint> make_velocity_limits(const RobotModel& model, double scale);
std::unique_ptr<Constraint> make_acceleration_limits(const RobotModel& model, double scale);
/// One row per pair of the model: ||c_i - c_j||^2 >= (r_i + r_j)^2, m^2.
std::unique_ptr<Constraint> make_self_collision(const RobotModel& model);

/// All registered constraints: a new one is added here, in one line, and nowhere else.
inline std::vector<std::unique_ptr<Constraint>> make_constraints(const RobotModel& model, const OcpSettings& settings) {
  std::vector<std::unique_ptr<Constraint>> all;
  all.push_back(make_position_limits(model));
  all.push_back(make_velocity_limits(model, settings.velocity_scale));
  all.push_back(make_acceleration_limits(model, settings.acceleration_scale));
  all.push_back(make_self_collision(model));
  return all;
}

}  // namespace steadyhand
