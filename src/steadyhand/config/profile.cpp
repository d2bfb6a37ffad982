#include "steadyhand/config/profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "steadyhand/ocp/term.hpp"

namespace steadyhand {

std::string describe_weights(const OcpSettings& ocp) {
  std::string text;
  for (const auto& objective : ocp.objectives) {
    const auto found = ocp.weights.find(objective->name());
    if (found == ocp.weights.end()) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", found->first, fmt::join(found->second, " "));
  }
  return text;
}

}  // namespace steadyhand
