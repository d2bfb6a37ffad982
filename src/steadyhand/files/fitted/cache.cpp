#include "steadyhand/files/fitted/cache.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>

#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/robot_file.hpp"
#include "steadyhand/geometry/fit/fit.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"
#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

constexpr int kVersion = 4;  ///< of fitter and URDF reader together: another one finds other bodies
constexpr int kJudged = 20'000;

/// FNV-1a, twice from different beginnings.
class Digest {
 public:
  void add(const std::string& bytes) {
    for (const char c : bytes) {
      for (std::uint64_t& state : states_) state = (state ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    }
    for (std::uint64_t& state : states_) state = (state ^ bytes.size()) * 0x100000001b3u;
  }
  std::string text() const { return fmt::format("{:016x}{:016x}", states_[0], states_[1]); }

 private:
  std::array<std::uint64_t, 2> states_{0xcbf29ce484222325u, 0x84222325cbf29ce4u};
};

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Digest of everything that a fit depends on; nothing if the URDF has no geometry.
Result<std::optional<std::string>> digest_of(const fs::path& urdf, const std::string& tip) {
  const Result<urdf::ModelInterfaceSharedPtr> model = read_urdf(urdf);
  if (!model) return model.error();
  std::error_code error;
  const fs::path folder = fs::absolute(urdf, error).parent_path();
  Digest digest;
  digest.add(fmt::format("{} {}", kVersion, tip));
  const Result<UrdfText> text = read_urdf_text(urdf);
  if (!text) return text.error();
  digest.add(text->text);
  bool any = false;
  const auto add = [&](const auto& elements) {
    for (const auto& element : elements) {
      any = any || element->geometry;
      const auto* mesh = dynamic_cast<const urdf::Mesh*>(element->geometry.get());
      const auto file = mesh == nullptr ? std::nullopt : find_mesh(folder, mesh->filename);
      if (file) digest.add(bytes_of(*file));
    }
  };
  for (const auto& [name, link] : (*model)->links_) {
    add(link->collision_array);
    add(link->visual_array);
  }
  return any ? std::optional(digest.text()) : std::nullopt;
}

fs::path cache_folder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && fs::path(cache).is_absolute()) return fs::path(cache) / "steadyhand";
  const char* home = std::getenv("HOME");
  return home != nullptr && *home != '\0' ? fs::path(home) / ".cache/steadyhand" : fs::path();
}

/// The file is there whole or not at all.
bool keep(const fs::path& file, const std::string& text) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  const fs::path begun = file.string() + fmt::format(".{}", getpid());
  std::ofstream stream(begun, std::ios::binary);
  stream << text;
  stream.close();
  if (stream) fs::rename(begun, file, error);
  if (stream && !error) return true;
  fs::remove(begun, error);
  return false;
}

}  // namespace

Result<RobotModel> open_urdf(const std::string& name, const std::string& tip, const Places& places) {
  const Result<fs::path> file = find_named_file(places, "robots", name);
  if (tip.empty() || !file) return open_robot(name, places);
  if (is_robot_file(*file))
    return Error{fmt::format("--tip is for URDFs; {} names the link that carries the tool", file->string())};
  RobotSettings settings;
  settings.urdf = *file;
  settings.tools = tools_on(tip);
  return load_robot(settings);
}

Result<RobotModel> open_fitted_robot(const std::string& name, const std::string& tip, const Places& places,
                                     const std::function<void(const std::string&)>& say,
                                     const std::function<void(const std::string&, double)>& progress) {
  const Result<fs::path> file = find_named_file(places, "robots", name);
  if (!file || is_robot_file(*file)) return open_urdf(name, tip, places);
  const Result<std::optional<std::string>> digest = digest_of(*file, tip);
  if (!digest) return digest.error();
  if (!digest->has_value()) return open_urdf(name, tip, places);

  const fs::path folder = cache_folder();
  const fs::path kept = folder / fmt::format("{}-{}.yaml", file->stem().string(), **digest);
  std::error_code error;
  if (!folder.empty() && fs::is_regular_file(kept, error)) {
    if (Result<RobotSettings> settings = load_robot_settings(kept, places)) {
      settings->urdf = *file;           // the same one may have moved
      settings->locked.clear();         // assumptions are reported again
      settings->tools = tools_on(tip);  // likewise
      Result<RobotModel> model = load_robot(*settings);
      if (model) {
        say(fmt::format("{}: {} bodies, fitted before ({})", name, model->bodies.size(), kept.string()));
        return model;
      }
    }
  }
  FitSettings settings;
  settings.urdf = *file;
  settings.tip = tip;
  settings.judged = kJudged;
  settings.progress = progress;
  Result<FitResult> fit = fit_bodies(settings);
  if (!fit) {  // collision geometry may be so coarse that the arm always touches itself
    settings.visual = true;
    Result<FitResult> shown = fit_bodies(settings);
    if (!shown) {
      settings.touching = true;
      shown = fit_bodies(settings);
    }
    if (shown) {
      say(fmt::format("{}: {}; its visual geometry is used instead", name, fit.error().message));
      for (const auto& [first, second] : shown->together)
        say(fmt::format("{}: no distance is kept between '{}' and '{}', which touch in every configuration", name,
                        first, second));
      fit = std::move(shown);
    }
  }
  if (!fit) {
    if (const auto chain = read_urdf_chain(*file, links_of(tools_on(tip))); !chain)
      return chain.error();  // no arm without bodies either
    return Error{
        fmt::format("no bodies could be fitted: {} (--no-fit accepts the arm without bodies)", fit.error().message)};
  }
  const std::string text = robot_file(*fit, "steadyhand fit " + file->filename().string(), folder);
  const bool stays = !folder.empty() && keep(kept, text);
  say(fmt::format("{}: {} bodies fitted to its meshes, {:.1f} % of the free configurations refused; {}", name,
                  fit->model.bodies.size(), fit->free > 0 ? 100.0 * fit->refused / fit->free : 0.0,
                  stays ? "kept in " + kept.string() : "not kept: " + kept.string() + " cannot be written"));
  return std::move(fit->model);
}

}  // namespace steadyhand
