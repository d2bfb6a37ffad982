// A term's name stands in its own file and nowhere else in the program or its page, so that a term can be added, or
// renamed, by touching one file. Profiles, docs and tests may name terms.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {
namespace {

namespace fs = std::filesystem;

/// Other things of the same name, by file.
const std::map<std::string, std::set<std::string>> kOthers = {
    // what holds the arm back: kinds of limits, of the constraint's and the arm's, in recordings and the protocol
    {"src/steadyhand/planning/plan/active_constraint.hpp", {"position", "velocity", "acceleration", "self_collision"}},
    {"src/steadyhand/report/figures/session_story.cpp", {"position", "velocity", "acceleration", "self_collision"}},
    {"web/src/protocol.ts", {"position", "velocity", "acceleration", "self_collision"}},
    {"web/src/descriptions.ts", {"velocity"}},
    {"web/src/session.ts", {"position", "velocity", "acceleration", "self_collision"}},
    {"web/src/scene/stage.ts", {"self_collision"}},
    {"web/protocol/schema.json", {"position", "velocity", "acceleration", "self_collision", "lateral"}},
    // the term whose pull the planner bounds, the rows that it fills, keys of problems and their obstacles
    {"src/steadyhand/planning/plan/planner.cpp", {"position"}},
    {"src/steadyhand/planning/plan/obstacle_rows.cpp", {"obstacles"}},
    {"src/steadyhand/files/record/problem_json.cpp", {"obstacles", "velocity"}},
    {"src/steadyhand/files/record/model_json.cpp", {"velocity"}},
    {"src/steadyhand/files/record/model_json.hpp", {"velocity"}},
    {"src/steadyhand/operator/protocol/requests.hpp", {"velocity"}},
    {"src/steadyhand/session/live/describe_snapshot.hpp", {"lateral"}},
    // attributes of a reference and a plan in Python
    {"src/steadyhand/apps/python/stages.cpp", {"velocity"}},
    {"src/steadyhand/core/describe.hpp", {"position"}},
    // members of a pose, Foxglove's and A-Frame's, the speed of a scene's things, and the force on the liquid
    {"src/steadyhand/files/record/message_style.hpp", {"position", "orientation"}},
    {"src/steadyhand/files/record/messages.hpp", {"velocity", "lateral"}},
    {"src/steadyhand/files/input/recording.hpp", {"position"}},
    {"src/steadyhand/files/input/aframe.cpp", {"position"}},
    // a key of cuRobo's spheres
    {"src/steadyhand/files/config/curobo_world.cpp", {"position"}},
    // curves of the measured acceleration
    {"src/steadyhand/report/figures/page_data.cpp", {"lateral", "vertical"}},
    {"src/steadyhand/report/figures/motion.cpp", {"lateral"}},
    {"web/report.html", {"lateral", "vertical"}},
    {"web/src/report/data.ts", {"lateral", "vertical"}},
    {"web/src/report/plots.ts", {"lateral", "vertical"}},
    {"web/src/plots/plots.ts", {"lateral"}},
    {"web/src/style.css", {"lateral"}},
    // the one weight that the menu of a headset has
    {"web/src/input/menu.ts", {"lateral"}},
    // an attribute of a mesh
    {"web/src/scene/ribbon.ts", {"position"}},
    {"web/src/scene/surroundings.ts", {"position"}},
    {"web/src/input/handles.ts", {"position"}},
    {"web/src/scene/glass.ts", {"position"}},
};

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// As a whole string, as a selector, or in `NAME_weight` and `objective_NAME`.
bool names(const std::string& text, const std::string& name) {
  if (text.find(name) == std::string::npos) return false;
  return std::regex_search(
      text, std::regex("[\"'`#]" + name + "[\"'`]|\\b" + name + "_weight|[\"'`.]objective_" + name + "\\b"));
}

struct Mention {
  std::string file, name;
  auto operator<=>(const Mention&) const = default;
};

/// Who names a term, but for the term's own file.
std::set<Mention> mentions(const fs::path& root, const std::set<std::string>& terms) {
  static const std::set<std::string> kinds = {".hpp", ".cpp", ".js", ".ts", ".html", ".css", ".json"};
  std::set<Mention> found;
  for (const char* folder : {"src", "web/src", "web/protocol", "web/index.html", "web/report.html"}) {
    std::vector<fs::path> files;
    if (fs::is_regular_file(root / folder)) files.push_back(root / folder);
    if (fs::is_directory(root / folder)) {
      for (const auto& entry : fs::recursive_directory_iterator(root / folder)) files.push_back(entry.path());
    }
    for (const fs::path& path : files) {
      const std::string file = fs::relative(path, root).generic_string();
      if (!kinds.count(path.extension().string()) || file.find("fixtures/") != std::string::npos) continue;
      const std::string text = text_of(path);
      for (const std::string& term : terms) {
        if (names(text, term)) found.insert({file, term});
      }
    }
  }
  return found;
}

bool is_own_file(const Mention& mention) {
  static const std::regex own(R"(src/steadyhand/planning/ocp/(objective|constraint)_(\w+)\.cpp)");
  std::smatch match;
  // position_limits and its like stand in constraint_limits.cpp.
  return std::regex_match(mention.file, match, own) && mention.name.ends_with(match[2].str());
}

std::set<std::string> all_terms() {
  std::mt19937 random(1);
  const RobotModel model = random_arm(3, random);
  OcpSettings settings;
  settings.obstacle_rows = 1;
  const Ocp ocp(model, settings);
  std::set<std::string> all;
  for (const auto& objective : ocp.objectives()) all.insert(objective->name());
  for (const auto& constraint : ocp.constraints()) all.insert(constraint->name());
  return all;
}

TEST(TermNames, StandInTheTermsOwnFiles) {
  const std::set<std::string> terms = all_terms();
  ASSERT_GE(terms.size(), 10u);
  std::set<std::string> at_home;
  std::set<Mention> known;
  for (const Mention& mention : mentions(STEADYHAND_ROOT, terms)) {
    if (is_own_file(mention)) {
      EXPECT_TRUE(at_home.insert(mention.name).second) << mention.name << " stands in two files";
      continue;
    }
    const auto other = kOthers.find(mention.file);
    const bool is_other = other != kOthers.end() && other->second.count(mention.name);
    EXPECT_TRUE(is_other) << mention.file << " names the term " << mention.name << "; take it from Objective::info()";
    if (is_other) known.insert(mention);
  }
  EXPECT_EQ(at_home, terms);
  for (const auto& [file, others] : kOthers) {
    for (const std::string& name : others) EXPECT_TRUE(known.count({file, name})) << file << " does not name " << name;
  }
}

TEST(TermNames, AreFoundWhereverTheyStand) {
  const fs::path root = fs::path(testing::TempDir()) / "term_names";
  fs::remove_all(root);
  const auto write = [&](const char* file, const char* text) {
    fs::create_directories((root / file).parent_path());
    std::ofstream(root / file) << text;
  };
  write("src/steadyhand/apps/commands/a.cpp", "if (term == \"lateral\") return;");
  write("src/steadyhand/planning/ocp/objective_lateral.cpp", ".name = \"lateral\"");
  write("src/steadyhand/operator/server/b.hpp", "double lateral_weight;");
  write("web/src/c.ts", "slider('lateral')");
  write("web/src/d.ts", "page.fill('#lateral')");
  write("web/src/innocent.ts", "lateral = 'bilateral'; // lateral \"laterally\"");
  write("web/index.html", "<input id=\"lateral\">");
  write("web/protocol/fixtures/e.json", "{\"lateral\": 1}");
  const std::set<Mention> found = mentions(root, {"lateral"});
  EXPECT_EQ(found, (std::set<Mention>{{"src/steadyhand/apps/commands/a.cpp", "lateral"},
                                      {"src/steadyhand/planning/ocp/objective_lateral.cpp", "lateral"},
                                      {"src/steadyhand/operator/server/b.hpp", "lateral"},
                                      {"web/index.html", "lateral"},
                                      {"web/src/c.ts", "lateral"},
                                      {"web/src/d.ts", "lateral"}}));
  EXPECT_FALSE(is_own_file({"src/steadyhand/apps/commands/a.cpp", "lateral"}));
  EXPECT_TRUE(is_own_file({"src/steadyhand/planning/ocp/objective_lateral.cpp", "lateral"}));
  EXPECT_FALSE(is_own_file({"src/steadyhand/planning/ocp/objective_vertical.cpp", "lateral"}));
}

}  // namespace
}  // namespace steadyhand
