#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace steadyhand {

/// Runs a program beside a session that moves an arm: at the lowest priority, the first that goes when memory runs out,
/// without this process's files and signals, and not longer than the thread that calls.
struct ModestProcess {
  std::string program;
  std::vector<std::string> arguments;
};

/// What it writes to stdout. Fails with what it writes to stderr if it does not end well, and once `end` is set.
Result<std::string> output_of(const ModestProcess& process, const std::atomic<bool>& end);

/// For such a process to begin with.
void be_modest();

}  // namespace steadyhand
