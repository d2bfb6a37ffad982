#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/planning/pipeline/profile.hpp"

namespace steadyhand {

/// What a session in a browser begins with, where there are no files.
struct BrowserSetup {
  RobotModel robot;
  Cell cell;                               ///< in the base
  std::vector<Profile> profiles;           ///< at least one
  int profile = 0;                         ///< index of the first
  std::vector<NamedRecording> recordings;  ///< hands that may play
};

/// As JSON, every number to its last digit. Objectives and constraints are the default ones.
std::string setup_json(const BrowserSetup& setup);

/// Refuses, with key and value, what is no JSON of setup_json(). Without exceptions (WebAssembly) that ends the program
/// with the same words.
Result<BrowserSetup> read_setup_json(std::string_view text);

}  // namespace steadyhand
