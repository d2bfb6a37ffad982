#pragma once

#include <functional>

#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// What the command line chose; main runs it. An Error is printed and ends the program with exit code 2.
using Command = std::function<Status()>;

// One file each, NAME_command.cpp: declares the subcommand and its options, and sets `chosen` when it is on the command
// line.
void add_config_command(CommandLine& app, Command& chosen);
/// @param exit_code becomes 1 if it ended because the arm was stopped
void add_demo_command(CommandLine& app, Command& chosen, int& exit_code);
/// @param exit_code becomes 1 if the link is not fit
void add_check_command(CommandLine& app, Command& chosen, int& exit_code);
void add_tasks_command(CommandLine& app, Command& chosen);
void add_replay_command(CommandLine& app, Command& chosen);
void add_report_command(CommandLine& app, Command& chosen);
void add_fit_command(CommandLine& app, Command& chosen);
void add_describe_command(CommandLine& app, Command& chosen);
void add_solve_command(CommandLine& app, Command& chosen);
void add_site_data_command(CommandLine& app, Command& chosen);

}  // namespace steadyhand
