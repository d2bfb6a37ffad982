#include "steadyhand/planning/pipeline/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace steadyhand {

void apply(const Profile& profile, RetargetSettings& retarget, PredictorSettings& predictor, OcpSettings& ocp,
           PlannerSettings& planner) {
  retarget.tilt_max = profile.tilt_max;
  predictor.model = profile.prediction;
  ocp = profile.ocp;
  planner.solver = profile.solver;
  planner.tolerance = profile.tolerance;
}

Status suits(const Profile& profile, const RobotModel& robot) {
  const auto ties = [](const auto& objective) { return objective->info().ties_tools; };
  const auto tie = std::ranges::find_if(profile.ocp.objectives, ties);
  const bool is_tied = tie != profile.ocp.objectives.end();
  if (robot.tool_count() > 1 || (!is_tied && profile.priority.empty())) return Done{};
  return Error{fmt::format("profile '{}' has a {}, which needs a robot with two tools; '{}' has one", profile.name,
                           is_tied ? "weight of " + (*tie)->name() : "priority", robot.name)};
}

std::string planner_differences(const Profile& a, const Profile& b) {
  const OcpSettings &p = a.ocp, &q = b.ocp;
  const bool liquids = p.liquid && q.liquid;  // of which the glass is the session's
  const bool same_margins = p.position_margin.size() == q.position_margin.size() &&
                            p.position_margin == q.position_margin;  // compared where the sizes agree
  std::string keys;
  for (const auto& [key, same] :
       {std::pair("horizon", p.horizon == q.horizon), std::pair("dt", p.dt == q.dt),
        std::pair("limits.velocity_scale", p.velocity_scale == q.velocity_scale),
        std::pair("limits.acceleration_scale", p.acceleration_scale == q.acceleration_scale),
        std::pair("position_margin", same_margins), std::pair("obstacle_rows", p.obstacle_rows == q.obstacle_rows),
        std::pair("liquid.margin", !liquids || p.liquid->margin == q.liquid->margin),
        std::pair("liquid.price", !liquids || p.liquid->price == q.liquid->price),
        std::pair("liquid.lean", !liquids || p.liquid->lean_max == q.liquid->lean_max),
        std::pair("liquid.least_weight", !liquids || p.liquid->least_weight == q.liquid->least_weight),
        std::pair("liquid.frequencies", !liquids || p.liquid->frequencies == q.liquid->frequencies),
        std::pair("solver", a.solver == b.solver), std::pair("tolerance", a.tolerance == b.tolerance)}) {
    if (!same) keys += (keys.empty() ? "" : ", ") + std::string(key);
  }
  return keys;
}

}  // namespace steadyhand
