#pragma once

#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/config/places.hpp"
#include "steadyhand/files/input/recording.hpp"
#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/planning/pipeline/profile.hpp"

namespace steadyhand {

/// The hands that come with the program. @param range of the first
Result<std::vector<NamedRecording>> bundled_recordings(const Places& places, const RecordingOptions& range = {});

/// All profiles of the checkout that suit the robot and, if it is none of them, the one asked for; which one that is.
/// Fails if that does not suit it.
Result<std::vector<Profile>> all_profiles(const std::string& wanted, const Places& places, const RobotModel& robot,
                                          int& index);

}  // namespace steadyhand
