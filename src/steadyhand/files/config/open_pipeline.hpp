#pragma once

#include <memory>
#include <string>

#include "steadyhand/files/config/places.hpp"
#include "steadyhand/planning/pipeline/pipeline.hpp"

namespace steadyhand {

/// A pipeline of a robot and a profile, each by name or file, as the program takes them. Fails where those cannot be
/// read, with the reason.
Result<std::unique_ptr<Pipeline>> open_pipeline(const std::string& robot, const std::string& profile,
                                                const Places& places = Places::standard());

}  // namespace steadyhand
