#pragma once

#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"
#include "steadyhand/planning/predict/predictor.hpp"

namespace steadyhand {

/// Sets the predictor's values that follow from the problem and the arm: horizon, dt and reach.
PredictorSettings complete(PredictorSettings predictor, const OcpSettings& ocp, const Reach& reach);

}  // namespace steadyhand
