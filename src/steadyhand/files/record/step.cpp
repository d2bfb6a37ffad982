#include "steadyhand/files/record/step.hpp"

#include "steadyhand/planning/ocp/term.hpp"

namespace steadyhand {

RunNames run_names(const RobotModel& model, const Objectives& objectives) {
  RunNames names;
  for (const Joint& joint : model.joints) {
    names.joints.push_back(joint.name);
    names.joint_units.push_back(joint.type == JointType::kPrismatic ? "m" : "rad");
  }
  for (const Tool& tool : model.tools) names.tools.push_back(tool.name);
  for (const auto& objective : objectives) names.terms.push_back(objective->name());
  return names;
}

}  // namespace steadyhand
