#pragma once

#include <string>
#include <string_view>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/input/hand_choice.hpp"
#include "steadyhand/files/input/sample_list.hpp"

namespace steadyhand {

/// Reads `t,px,py,pz,qx,qy,qz,qw[,clutch]`, columns in any order, into `samples`; or `t` and these columns of several
/// hands, with the hand's name before each, as in `left_px`. `name` is the file's, for messages.
Status read_csv(std::string_view text, const std::string& name, const ChooseHands& choose, SampleList& samples);

}  // namespace steadyhand
