#pragma once

#include <memory>
#include <vector>

#include "steadyhand/ocp/term.hpp"

namespace steadyhand {

// Each has a file of its own, objective_NAME.cpp; the equations are those of docs/formulation.md.
std::unique_ptr<Objective> make_position_objective();      ///< (p - p_ref)' diag(w) (p - p_ref), w: 3
std::unique_ptr<Objective> make_orientation_objective();   ///< w ||I - R R_ref'||_F^2, w: 1
std::unique_ptr<Objective> make_velocity_objective();      ///< dq' diag(w) dq, w: n
std::unique_ptr<Objective> make_acceleration_objective();  ///< u' diag(w) u, w: n
std::unique_ptr<Objective> make_lateral_objective();       ///< w (a_x^2 + a_y^2), a = a_local, w: 1
std::unique_ptr<Objective> make_vertical_objective();      ///< w (a_z - g)^2, w: 1

/// All registered objectives: a new one is added here, in one line, and nowhere else.
inline std::vector<std::unique_ptr<Objective>> make_objectives() {
  std::vector<std::unique_ptr<Objective>> all;
  all.push_back(make_position_objective());
  all.push_back(make_orientation_objective());
  all.push_back(make_velocity_objective());
  all.push_back(make_acceleration_objective());
  all.push_back(make_lateral_objective());
  all.push_back(make_vertical_objective());
  return all;
}

}  // namespace steadyhand
