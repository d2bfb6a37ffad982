#pragma once

#include <string>
#include <string_view>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/input/sample_list.hpp"

namespace steadyhand {

/// Reads `t,px,py,pz,qx,qy,qz,qw[,clutch]`, columns in any order, into `samples`. `name` is the file's, for messages.
Status read_csv(std::string_view text, const std::string& name, SampleList& samples);

}  // namespace steadyhand
