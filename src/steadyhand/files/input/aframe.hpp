#pragma once

#include <string>
#include <string_view>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/input/hand_choice.hpp"
#include "steadyhand/files/input/sample_list.hpp"

namespace steadyhand {

/// Reads tracks of an A-Frame motion capture into `samples`, turned to robot axes; see load_recording. `name` is the
/// file's, for messages.
Status read_aframe(std::string_view text, const std::string& name, const ChooseHands& choose, SampleList& samples);

}  // namespace steadyhand
