#include <iostream>
#include <memory>

#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/apps/commands/settings_options.hpp"

namespace steadyhand {

namespace {

Status run(const SettingsOptions& options) {
  SessionSettings settings;
  SettingsTable table = describe(settings);
  if (Status s = options.apply(table); !s) return s;
  if (Status s = settings.resolve(table); !s) return s;
  std::cout << "# Settings of a live session: value, unit, meaning, [origin]. For `steadyhand demo --settings FILE`.\n"
            << table.format();
  return Done{};
}

}  // namespace

void add_config_command(CommandLine& app, Command& chosen) {
  const auto options = std::make_shared<SettingsOptions>();
  CommandLine* command = app.add_subcommand("config", "Print the settings of a live session, with unit and origin");
  add_settings_options(*command, *options);
  command->footer("The output is a settings file: ./steadyhand config > my.yaml");
  command->callback([options, &chosen] { chosen = [options] { return run(*options); }; });
}

}  // namespace steadyhand
