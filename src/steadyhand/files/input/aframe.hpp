#pragma once

#include <string>
#include <string_view>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/input/sample_list.hpp"

namespace steadyhand {

/// Reads one track of an A-Frame motion capture into `samples`, turned to robot axes; see load_recording. `track` may
/// be empty. Returns the key of the track that was read. `name` is the file's, for messages.
Result<std::string> read_aframe(std::string_view text, const std::string& name, const std::string& track,
                                SampleList& samples);

}  // namespace steadyhand
