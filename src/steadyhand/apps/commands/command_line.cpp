#include "steadyhand/apps/commands/command_line.hpp"

#include <CLI/CLI.hpp>
#include <deque>
#include <iostream>
#include <utility>

namespace steadyhand {
namespace {

/// For a shell: in quotation marks if anything in it has a meaning there.
std::string quoted(const std::string& word) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=.,:/@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

struct CommandLine::Impl {
  std::unique_ptr<CLI::App> own;  ///< nullptr for a subcommand, which belongs to the one above
  CLI::App* app = nullptr;
  std::deque<CommandLine> subcommands;
};

using Option = CommandLine::Option;

const Option* Option::required() const {
  option_->required();
  return this;
}

const Option* Option::capture_default_str() const {
  option_->capture_default_str();
  return this;
}

const Option* Option::expected(int least, int most) const {
  option_->expected(least, most);
  return this;
}

const Option* Option::group(const std::string& name) const {
  option_->group(name);
  return this;
}

const Option* Option::among(const std::vector<std::string>& values) const {
  option_->check(CLI::IsMember(values));
  return this;
}

const Option* Option::within(double low, double high) const {
  option_->check(CLI::Range(low, high));
  return this;
}

CommandLine::CommandLine(const std::string& name, const std::string& description) : impl_(std::make_unique<Impl>()) {
  impl_->own = std::make_unique<CLI::App>(description);
  impl_->app = impl_->own.get();
  impl_->app->name(name);
}
CommandLine::CommandLine(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CommandLine::~CommandLine() = default;
CommandLine::CommandLine(CommandLine&&) noexcept = default;

CommandLine* CommandLine::add_subcommand(const std::string& name, const std::string& description) {
  impl_->app->require_subcommand(0, 1);
  auto impl = std::make_unique<Impl>();
  impl->app = impl_->app->add_subcommand(name, description);
  impl_->subcommands.push_back(CommandLine(std::move(impl)));
  return &impl_->subcommands.back();
}

Option CommandLine::add(const std::string& name, const Target& target, const std::string& help) {
  return Option(*std::visit([&](auto* value) { return impl_->app->add_option(name, *value, help); }, target));
}

Option CommandLine::add_flag(const std::string& name, bool& target, const std::string& help) {
  return Option(*impl_->app->add_flag(name, target, help));
}

void CommandLine::add_option_function(const std::string& name, std::function<void(const std::string&)> take,
                                      const std::string& help) {
  impl_->app->add_option_function<std::string>(name, std::move(take), help);
}

void CommandLine::add_flag_callback(const std::string& name, std::function<void()> take, const std::string& help) {
  impl_->app->add_flag_callback(name, std::move(take), help);
}

void CommandLine::footer(const std::string& text) { impl_->app->footer(text); }
void CommandLine::callback(std::function<void()> call) { impl_->app->callback(std::move(call)); }
void CommandLine::version(const std::string& text) { impl_->app->set_version_flag("--version", text); }

bool CommandLine::given(const std::string& option) const { return impl_->app->get_option(option)->count() > 0; }

std::string CommandLine::as_typed(const std::string& without) const {
  std::string text = impl_->app->get_name();
  for (const CLI::Option* option : impl_->app->get_options([](const CLI::Option* o) { return o->count() > 0; })) {
    if (option->check_name(without)) continue;
    if (!option->get_positional()) text += " " + option->get_name();
    if (option->get_items_expected_max() == 0) continue;  // a flag
    for (const std::string& value : option->results()) text += " " + quoted(value);
  }
  return text;
}

std::vector<std::string> CommandLine::subcommands() const {
  std::vector<std::string> names;
  for (const CommandLine& each : impl_->subcommands) names.push_back(each.impl_->app->get_name());
  return names;
}

Result<bool> CommandLine::parse(int argc, char** argv) {
  try {
    impl_->app->parse(argc, argv);
    return true;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) return Error{error.what()};
    impl_->app->exit(error);  // --help, --version
    return false;
  }
}

}  // namespace steadyhand
