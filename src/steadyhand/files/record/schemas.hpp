#pragma once

#include <string>

/// JSON Schemas of what json_messages.hpp writes. Where one of Foxglove's well-known schemas fits, it carries that
/// name, so that viewers draw it; what our arrows hold beyond it are further properties.
namespace steadyhand {

struct Schema {
  std::string name;
  std::string text;
};

Schema operator_sample_schema();  ///< foxglove.PoseInFrame, frame "operator"
Schema target_schema();           ///< foxglove.PoseInFrame, frame "base"
Schema reference_schema();        ///< foxglove.PosesInFrame, frame "base"
Schema plan_schema();             ///< foxglove.PosesInFrame, frame "base"
Schema joint_command_schema();
Schema joint_state_schema();
Schema plan_step_schema();
Schema supervision_schema();
Schema operator_settings_schema();
Schema liquid_schema();
Schema active_constraint_schema();
Schema cell_schema();
Schema statistics_schema();
Schema episode_schema();
Schema scene_schema();
Schema video_schema();  ///< foxglove.CompressedVideo

}  // namespace steadyhand
