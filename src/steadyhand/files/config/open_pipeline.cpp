#include "steadyhand/files/config/open.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {

Result<std::unique_ptr<Pipeline>> open_pipeline(const std::string& robot, const std::string& profile,
                                                const Places& places) {
  Result<RobotModel> model = open_robot(robot, places);
  if (!model) return model.error();
  Result<Profile> settings = load_profile(profile, places);
  if (!settings) return settings.error();
  add_posture_where_redundant(settings->ocp, *model);
  return Pipeline::make(*std::move(model), PipelineSettings(*settings));
}

}  // namespace steadyhand
