#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// A program alongside a session that moves an arm, without this process's files and signals.
struct ModestProcess {
  std::string program;  ///< a path, or what is searched for in PATH
  std::vector<std::string> arguments;
};

/// Runs it with this file as its stdout. It should be_modest(), and runs no longer than the thread that calls. Fails
/// with what it writes to stderr if it does not end well, and once `end` is set.
Status run_into(const ModestProcess& process, int file, const std::atomic<bool>& end);

/// Starts a program that continues when this one ends: it gets none of our files, output and terminal. Whether it runs
/// is not reported.
void launch(const ModestProcess& process);

/// The first call of such a process: lowest priority, bounded memory and output, ended first when memory runs out.
void be_modest();

}  // namespace steadyhand
