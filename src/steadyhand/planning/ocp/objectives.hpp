#pragma once

#include <memory>

#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

// Each is in its own file, objective_NAME.cpp; the equations are in docs/explanation/formulation.md.
// default_objectives() (ocp.cpp) lists them.
std::shared_ptr<const Objective> make_position_objective();      ///< (p - p_ref)' diag(w) (p - p_ref), w: 3
std::shared_ptr<const Objective> make_orientation_objective();   ///< ||(R - R_ref) diag(w)^(1/2)||_F^2, w: 3
std::shared_ptr<const Objective> make_velocity_objective();      ///< dq' diag(w) dq, w: n
std::shared_ptr<const Objective> make_acceleration_objective();  ///< u' diag(w) u, w: n
std::shared_ptr<const Objective> make_lateral_objective();       ///< w (a_x^2 + a_y^2), a = a_local, w: 1
std::shared_ptr<const Objective> make_vertical_objective();      ///< w (a_z - g)^2, w: 1
// Not by default:
std::shared_ptr<const Objective> make_posture_objective();            ///< (q - q_home)' diag(w) (q - q_home), w: n
std::shared_ptr<const Objective> make_relative_pose_objective();      ///< of the second tool in the first, w: 2
std::shared_ptr<const Objective> make_acceleration_step_objective();  ///< (u_0 - u_followed)' diag(w) (same), w: n

}  // namespace steadyhand
