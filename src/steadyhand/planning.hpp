#pragma once

/// Planning: from the operator's hand to joint commands by model predictive control. `Pipeline` has all stages on one
/// thread; `Planner`, `Solver` and the terms of the problem can be used alone.
///
///     auto arm = open_pipeline("ur5e", "waiter");     // steadyhand/files.hpp
///     (*arm)->feed({{now, now}, X_operator_hand, clutch});
///     JointCommand command = (*arm)->update(now);

#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/pipeline/pipeline.hpp"
