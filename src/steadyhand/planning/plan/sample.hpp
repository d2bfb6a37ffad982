#pragma once

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// q, dq, ddq at time t of a plan: exact between nodes; before the start the first state, after the end the last one at
/// rest. Safe for every time, and for intervals of any length. Allocates nothing.
JointCommand sample(const Plan& plan, Time t);

/// A plan that stands at q from `start` on. Allocates nothing.
void stand(const JointVector& q, Time start, Plan& plan);

}  // namespace steadyhand
