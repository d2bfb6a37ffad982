// YAML: a robot file, a profile and settings, all of them from the same text.
#include "fuzz/fuzz.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/robot_file.hpp"
#include "steadyhand/operator/console/settings.hpp"

namespace steadyhand {

FUZZ(yaml) {
  const std::filesystem::path path = fuzz::as_file(input);
  static const Places places = Places::standard();
  const auto refused = [](const auto& result) {
    if (!result) fuzz::require(!result.error().message.empty(), "a refusal says why");
    return !result;
  };
  (void)refused(load_robot_settings(path, places));
  const Result<Profile> profile = load_profile(path.string(), places);
  if (!refused(profile)) {
    for (const auto& [term, weights] : profile->ocp.weights) {
      for (const double weight : weights) fuzz::require(weight >= 0.0 && weight < 1e300, "a weight");
    }
  }
  SessionSettings settings;
  SettingsTable table = describe(settings);
  if (!refused(table.load(path))) {
    (void)settings.resolve(table);
    fuzz::require(table.format().size() > 1000, "all settings");
  }
}

}  // namespace steadyhand
