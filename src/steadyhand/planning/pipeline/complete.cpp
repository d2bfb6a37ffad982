#include "steadyhand/planning/pipeline/complete.hpp"

namespace steadyhand {

PredictorSettings complete(PredictorSettings predictor, const OcpSettings& ocp, const Reach& reach) {
  predictor.horizon = ocp.horizon;
  predictor.dt = ocp.dt;
  predictor.reach_center = reach.center;
  predictor.reach = reach.radius;
  return predictor;
}

}  // namespace steadyhand
