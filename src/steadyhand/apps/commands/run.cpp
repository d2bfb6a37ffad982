#include "steadyhand/apps/commands/run.hpp"

#include <unistd.h>

#include <algorithm>
#include <exception>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/nearest.hpp"
#include "steadyhand/core/printable_stream.hpp"

namespace steadyhand {

namespace {

/// CLI11 would only report that a command is missing.
std::optional<std::string> unknown_command(const CommandLine& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return std::nullopt;
  const std::vector<std::string> known = app.subcommands();
  if (std::find(known.begin(), known.end(), argv[1]) != known.end()) return std::nullopt;
  return "unknown command '" + std::string(argv[1]) + "'; " + suggestion(argv[1], known);
}

}  // namespace

Result<int> run(CommandLine& app, const Command& chosen, const int& exit_code, int argc, char** argv) {
  const std::string help = " (see steadyhand --help)";
  if (const auto unknown = unknown_command(app, argc, argv)) return Error{*unknown + help};
  const Result<bool> parsed = app.parse(argc, argv);
  if (!parsed) return Error{parsed.error().message + help};
  if (!*parsed) return 0;
  if (!chosen) return Error{"a command is expected" + help};
  std::optional<PrintableStream> out, errors;  // pipes and files get every byte
  if (isatty(STDOUT_FILENO)) out.emplace(std::cout);
  if (isatty(STDERR_FILENO)) errors.emplace(std::cerr);
  try {
    const Status status = chosen();
    if (!status) return status.error();
    std::cout.flush();
    return std::cout ? Result<int>(exit_code) : Error{"cannot write to stdout"};
  } catch (const std::exception& error) {  // out of memory and the like
    return Error{error.what()};
  }
}

}  // namespace steadyhand
