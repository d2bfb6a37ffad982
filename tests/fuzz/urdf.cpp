// A URDF that describes a complete robot.
#include "fuzz/fuzz.hpp"
#include "steadyhand/geometry/robot/loading.hpp"

/// urdfdom itself leaks what it refuses when every link is part of a loop.
extern "C" const char* __lsan_default_suppressions() { return "leak:liburdfdom_model"; }

namespace steadyhand {

FUZZ(urdf) {
  RobotSettings settings;
  settings.urdf = fuzz::as_file(input);
  const Result<RobotModel> model = load_robot(settings);
  if (!model) return fuzz::require(!model.error().message.empty(), "a refusal says why");
  fuzz::require(model->dof() >= 1 && model->dof() <= kMaxJoints, "joints");
  fuzz::require(model->home.allFinite() && model->velocity_max.minCoeff() > 0.0, "numbers");
  fuzz::require(((model->position_max - model->position_min).array() > 0.0).all(), "limits");
  for (const Joint& joint : model->joints) {
    fuzz::require(joint.origin.matrix().allFinite() && std::abs(joint.axis.norm() - 1.0) < 1e-9, "a joint's frame");
  }
}

}  // namespace steadyhand
