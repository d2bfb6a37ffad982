#ifdef STEADYHAND_FIT

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/apps/commands/progress_bar.hpp"
#include "steadyhand/geometry/fit/fit.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

struct Options {
  fs::path urdf, out, picture;
  std::string tip;
  std::vector<std::string> meshes;
  int most = 4, rounds = 2, judge = 100'000;
  bool no_boxes = false, visual = false, touching = false, force = false;
  std::uint32_t seed = 1;
  std::string command;
};

/// Written next to the file until it is complete.
fs::path draft_of(const fs::path& file) { return file.string() + fmt::format(".{}.part", getpid()); }

/// The file is there whole or, as before, not at all.
Status write(const fs::path& file, const std::string& text) {
  const fs::path draft = draft_of(file);
  std::ofstream stream(draft, std::ios::binary);
  stream << text;
  stream.close();
  std::error_code error;
  if (stream) fs::rename(draft, file, error);
  if (stream && !error) return Done{};
  std::error_code ignored;
  fs::remove(draft, ignored);
  return Error{fmt::format("{} cannot be written{}", file.string(), error ? ": " + error.message() : "")};
}

/// What a minute later would be in vain.
Status check_writable(const fs::path& file, const fs::path& urdf, bool force) {
  std::error_code error;
  if (fs::equivalent(file, urdf, error)) return Error{fmt::format("{} is the URDF itself", file.string())};
  if (fs::is_directory(file, error))
    return Error{fmt::format("{} is a folder; a file is to be written", file.string())};
  if (!force && fs::exists(file, error))
    return Error{fmt::format("{} is there already; --force writes over it", file.string())};
  const fs::path draft = draft_of(file);
  const bool writable = std::ofstream(draft, std::ios::binary).is_open();
  fs::remove(draft, error);
  return writable ? Status(Done{}) : Error{fmt::format("{} cannot be written", file.string())};
}

Status run(const Options& options) {
  FitSettings settings;
  settings.urdf = options.urdf;
  settings.tip = options.tip;
  settings.most = options.most;
  settings.boxes = !options.no_boxes;
  settings.visual = options.visual;
  settings.touching = options.touching;
  settings.judged = options.judge;
  settings.rounds = options.rounds;
  settings.seed = options.seed;
  for (const std::string& given : options.meshes) {
    const std::size_t equal = given.find('=');
    if (equal == 0 || equal == std::string::npos || equal + 1 == given.size()) {
      return Error{fmt::format("--mesh {}: must be LINK=FILE", given)};
    }
    settings.meshes[given.substr(0, equal)].push_back(given.substr(equal + 1));
  }
  const fs::path out = options.out.empty() ? options.urdf.filename().replace_extension(".yaml") : options.out;
  for (const fs::path& file : {out, options.picture}) {
    if (file.empty()) continue;
    if (Status s = check_writable(file, options.urdf, options.force); !s) return s;
  }
  ProgressBar bar(1, "fit:");
  settings.progress = [&](const std::string& what, double fraction) { bar.show(what, fraction); };
  const Result<FitResult> result = fit_bodies(settings);
  bar.finish();
  if (!result) return result.error();
  for (const std::string& assumption : result->model.assumptions) std::cerr << "note: " << assumption << "\n";
  std::error_code error;
  if (Status s = write(out, robot_file(*result, options.command, fs::absolute(out, error).parent_path())); !s) return s;
  if (!options.picture.empty()) {
    if (Status s = write(options.picture, fit_picture(*result)); !s) return s;
  }
  std::cout << fit_table(*result) << "written: " << out.string() << "\n";
  return Done{};
}

}  // namespace

void add_fit_command(CommandLine& app, Command& chosen) {
  const auto options = std::make_shared<Options>();
  CommandLine* command = app.add_subcommand("fit", "Fit bodies to an arm's meshes, and write a robot file with them");
  command->add_option("urdf", options->urdf, "URDF with its meshes")->required();
  command->add_option("--out", options->out, "Robot file to write (default: the URDF's name, in this folder)");
  command->add_option(
      "--tip", options->tip,
      "URDF link that carries the tool, or LINK,LINK for two arms (default: the end of the longest chain)");
  command->add_flag("--force", options->force, "Overwrite existing files");
  command->add_option("--picture", options->picture, "Draw meshes and bodies, SVG");
  command->add_option("--most", options->most, "Largest number of bodies per link")
      ->within(1, 12)
      ->capture_default_str();
  command
      ->add_option("--rounds", options->rounds,
                   "Rounds in which each link is fitted again to the others' bodies; 0 is fast")
      ->within(0, 100)
      ->capture_default_str();
  command->add_flag("--no-boxes", options->no_boxes, "Spheres and capsules only");
  command->add_flag("--touching", options->touching,
                    "Accept links that touch in every configuration; no distance is kept between them");
  command->add_flag("--visual", options->visual, "Cover visual geometry instead of collision geometry");
  command->add_option("--mesh", options->meshes,
                      "LINK=FILE ...: cover these files instead of the link's own geometry, in the frame of its mesh");
  command
      ->add_option("--judge", options->judge,
                   "Random configurations that measure the free space lost to the bodies; 0: none")
      ->within(0, 1e7)
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the search")->capture_default_str();
  command->footer(
      "Examples:\n"
      "  steadyhand fit my_arm.urdf --picture my_arm.svg\n"
      "  steadyhand fit my_arm.urdf --tip flange --no-boxes --out without_hand.yaml");
  command->callback([options, command, &chosen] {
    options->command = "steadyhand " + command->as_typed("--picture");
    chosen = [options] { return run(*options); };
  });
}

}  // namespace steadyhand

#endif
