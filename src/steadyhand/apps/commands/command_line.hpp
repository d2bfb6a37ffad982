#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "steadyhand/core/result.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace steadyhand {

/// A command line, or a subcommand's. Only one file includes CLI11: it takes seconds to compile.
class CommandLine {
 public:
  /// An option that was added; -> chains, as with CLI11.
  class Option {
   public:
    explicit Option(CLI::Option& option) : option_(&option) {}
    const Option* operator->() const { return this; }
    const Option* required() const;
    const Option* capture_default_str() const;           ///< --help shows the value that it has now
    const Option* expected(int least, int most) const;   ///< values; -1 at most: any number
    const Option* group(const std::string& name) const;  ///< of --help
    const Option* among(const std::vector<std::string>& values) const;
    const Option* within(double low, double high) const;

   private:
    CLI::Option* option_;
  };
  /// Variables that an option may set.
  using Target = std::variant<bool*, int*, std::uint16_t*, std::uint32_t*, std::uint64_t*, double*, std::optional<int>*,
                              std::optional<double>*, std::string*, std::filesystem::path*, std::vector<int>*,
                              std::vector<std::string>*>;

  CommandLine(const std::string& name, const std::string& description);
  ~CommandLine();
  CommandLine(CommandLine&&) noexcept;

  /// It belongs to this command line.
  CommandLine* add_subcommand(const std::string& name, const std::string& description);
  /// A name without dashes is filled by its place. Targets must outlive parsing.
  template <typename T>
  Option add_option(const std::string& name, T& target, const std::string& help) {
    return add(name, Target(&target), help);
  }
  Option add_flag(const std::string& name, bool& target, const std::string& help);
  /// Calls `take` with each value.
  void add_option_function(const std::string& name, std::function<void(const std::string&)> take,
                           const std::string& help);
  void add_flag_callback(const std::string& name, std::function<void()> take, const std::string& help);
  void footer(const std::string& text);       ///< of --help
  void callback(std::function<void()> call);  ///< if this command was named
  void version(const std::string& text);      ///< what --version prints

  bool given(const std::string& option) const;
  /// The options that were given and their values, as one would type them, except `without`.
  std::string as_typed(const std::string& without) const;
  std::vector<std::string> subcommands() const;

  /// False: --help or --version was asked for, and is answered on stdout. An Error has the reason.
  Result<bool> parse(int argc, char** argv);

 private:
  struct Impl;
  explicit CommandLine(std::unique_ptr<Impl> impl);
  Option add(const std::string& name, const Target& target, const std::string& help);

  std::unique_ptr<Impl> impl_;
};

}  // namespace steadyhand
