#pragma once

#include <memory>

#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

// Each is in its own file, constraint_NAME.cpp. The model must outlive the constraint. default_constraints()
// (ocp.cpp) lists them.
std::shared_ptr<const Constraint> make_position_limits(const RobotModel& model, const OcpSettings& settings);
std::shared_ptr<const Constraint> make_velocity_limits(const RobotModel& model, const OcpSettings& settings);
std::shared_ptr<const Constraint> make_acceleration_limits(const RobotModel& model, const OcpSettings& settings);
/// Keeps the position at which each joint stops if it brakes at once inside its position limits, rad (m). Null without
/// a position_margin: the paper's problem does not have this constraint.
std::shared_ptr<const Constraint> make_stopping(const RobotModel& model, const OcpSettings& settings);
/// One row per pair of the model: gap >= 0, m.
std::shared_ptr<const Constraint> make_self_collision(const RobotModel& model, const OcpSettings& settings);

/// One row per NearObstacle of the instance: gap between body and obstacle >= 0, m. Null without such rows.
std::shared_ptr<const Constraint> make_obstacles(const RobotModel& model, const OcpSettings& settings);

/// Wave of each mode of each tool's liquid, less the room of the instance <= 0, m; at a price. Null without a liquid.
std::shared_ptr<const Constraint> make_no_spill(const RobotModel& model, const OcpSettings& settings);
/// Specific force along each glass's axis, at least a share of g, m/s^2; at a price. Null without a liquid.
std::shared_ptr<const Constraint> make_held_down(const RobotModel& model, const OcpSettings& settings);
/// Cosine of each glass's lean, at least that of the largest; at a price. Null without a liquid.
std::shared_ptr<const Constraint> make_lean(const RobotModel& model, const OcpSettings& settings);

}  // namespace steadyhand
