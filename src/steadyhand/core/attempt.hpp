#pragma once

#include <exception>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Does the work and returns an exception as an error. For threads: an exception that leaves a thread ends the program.
template <typename Work>
Status attempt(const Work& work) {
  try {
    work();
    return Done{};
  } catch (const std::exception& error) {
    return Error{error.what()};
  } catch (...) {
    return Error{"something of unknown kind was thrown"};
  }
}

}  // namespace steadyhand
