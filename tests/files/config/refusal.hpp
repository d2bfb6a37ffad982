#pragma once

#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "steadyhand/files/config/places.hpp"

namespace steadyhand {

/// Where the checkout and the installed packages are.
inline const Places kPlaces = Places::standard();

/// A file that must be refused, and what the message must contain.
struct Refusal {
  const char* name;
  const char* text;
  const char* message;
};
inline void PrintTo(const Refusal& refusal, std::ostream* stream) { *stream << refusal.name; }
inline std::string refusal_name(const testing::TestParamInfo<Refusal>& refusal) { return refusal.param.name; }

}  // namespace steadyhand
