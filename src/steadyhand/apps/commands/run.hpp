#pragma once

#include "steadyhand/apps/commands/commands.hpp"

namespace steadyhand {

/// Parses the command line and runs the command that it chose. Returns `exit_code` as it is then, or 0 after --help; an
/// Error has the reason, with the input or the command line.
Result<int> run(CommandLine& app, const Command& chosen, const int& exit_code, int argc, char** argv);

}  // namespace steadyhand
