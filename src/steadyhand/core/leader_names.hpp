#pragma once

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/names.hpp"

namespace steadyhand {

constexpr auto names_of(Leader) {
  return named("Leader", {Name{Leader::kPerson, "person"}, Name{Leader::kRecording, "recording", "that plays"},
                          Name{Leader::kPolicy, "policy"}});
}

}  // namespace steadyhand
