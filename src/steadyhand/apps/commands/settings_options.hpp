#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/operator/console/settings.hpp"

namespace steadyhand {

/// A live session's settings from the command line.
struct SettingsOptions {
  struct Given {
    std::string key, value, option;
  };
  std::filesystem::path file;
  std::vector<std::string> assignments;  ///< KEY=VALUE
  std::vector<Given> given;              ///< by dedicated options

  /// Defaults, then the file, then the options, then the assignments; the last word counts.
  Status apply(SettingsTable& table) const;
};

/// The arm is controlled by an operator, or by a script, for which some settings are fixed.
enum class OptionsFor { kOperator, kTasks };

/// Adds --settings, --set, and options for what is set most. `options` must live as long as the command.
void add_settings_options(CommandLine& command, SettingsOptions& options, OptionsFor who = OptionsFor::kOperator);

}  // namespace steadyhand
