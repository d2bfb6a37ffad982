// No #include points up. CMakeLists.txt says which parts a part uses; since all of src/ is one include root, the
// compiler would not notice a header of another part.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
/// Part -> parts that its files may include, both as `MODULE/PART`; `core` is a part of its own.
using Parts = std::map<std::string, std::set<std::string>>;

/// A file and what it includes, both as `steadyhand/ROOM/file.hpp`.
struct Include {
  std::string file, header;
};

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// `core`, or `MODULE/PART`. Empty for a path that does not begin with `steadyhand/`: an installed header must not
/// include it.
std::string part_of(const std::string& path) {
  const std::string root = "steadyhand/", core = root + "core/";
  if (path.starts_with(core)) return "core";
  return path.starts_with(root) ? path.substr(root.size(), path.find_last_of('/') - root.size()) : "";
}

/// The module of `steadyhand/MODULE.hpp`; empty for any other file.
std::string facade_of(const std::string& path) {
  std::smatch match;
  return std::regex_match(path, match, std::regex(R"(steadyhand/(\w+)\.hpp)")) ? match[1].str() : "";
}

std::string module_of(const std::string& part) { return part.substr(0, part.find('/')); }

/// Reads `steadyhand_part(MODULE/PART USES a b LINK ...)`, top to bottom, where USES has parts without their module. A
/// part may use itself and, through the parts it names, theirs; apps/commands and apps/python everything. Naming a part
/// that does not stand above is reported in `complaints`.
Parts read_parts(const std::string& cmake, std::vector<std::string>& complaints) {
  Parts parts;
  std::map<std::string, std::string> paths;  // by name
  const std::regex call(R"(steadyhand_part\(\s*([\w/]+)([^)]*)\))");
  for (std::sregex_iterator it(cmake.begin(), cmake.end(), call), end; it != end; ++it) {
    const std::string path = (*it)[1];
    std::set<std::string> allowed = {path};
    std::istringstream words((*it)[2]);
    bool in_uses = false;
    for (std::string word; words >> word;) {
      if (word == "USES" || word == "LINK" || word == "TEST_LINK" || word == "EXCEPT" || word == "BARE") {
        in_uses = word == "USES";
      } else if (in_uses && !paths.count(word)) {
        complaints.push_back("CMakeLists.txt: " + path + " uses " + word + ", which does not stand above it");
      } else if (in_uses) {
        allowed.insert(parts[paths[word]].begin(), parts[paths[word]].end());
      }
    }
    parts[path] = allowed;
    paths[path.substr(path.find_last_of('/') + 1)] = path;
  }
  std::set<std::string> all = {"apps/commands", "apps/python"};
  for (const auto& [path, allowed] : parts) all.insert(path);
  parts["apps/commands"] = parts["apps/python"] = all;
  return parts;
}

/// A module that uses one which, through others, uses it: "a uses b".
std::vector<std::string> circles(const Parts& parts) {
  std::map<std::string, std::set<std::string>> uses;
  for (const auto& [path, allowed] : parts)
    for (const std::string& used : allowed)
      if (module_of(used) != module_of(path)) uses[module_of(path)].insert(module_of(used));
  for (std::size_t i = 0; i < uses.size(); ++i)
    for (auto& [module, used] : uses)
      for (const std::string& other : std::set<std::string>(used)) used.insert(uses[other].begin(), uses[other].end());
  std::vector<std::string> found;
  for (const auto& [module, used] : uses)
    if (used.count(module)) found.push_back(module + " uses itself through other modules");
  return found;
}

std::vector<Include> read_includes(const fs::path& src) {
  std::vector<Include> includes;
  const std::regex include(R"(^\s*#\s*include\s*"([^"]+)\")");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(src)) {
    const fs::path& path = entry.path();
    if (path.extension() != ".hpp" && path.extension() != ".cpp") continue;
    std::istringstream lines(text_of(path));
    std::smatch match;
    for (std::string line; std::getline(lines, line);)
      if (std::regex_search(line, match, include))
        includes.push_back({fs::relative(path, src).generic_string(), match[1]});
  }
  return includes;
}

std::vector<std::string> violations(const Parts& parts, const std::vector<Include>& includes) {
  std::vector<std::string> found;
  for (const Include& include : includes) {
    if (const std::string facade = facade_of(include.file); !facade.empty()) {  // its module's headers alone
      if (module_of(part_of(include.header)) != facade)
        found.push_back(include.file + " includes " + include.header + ", which is not of " + facade);
      continue;
    }
    std::string path = part_of(include.file);
    if (!parts.count(path)) path = path.substr(0, path.find_last_of('/'));  // a folder of a part
    const auto part = parts.find(path);
    std::string used = part_of(include.header);
    if (!parts.count(used)) used = used.substr(0, used.find_last_of('/'));
    if (part == parts.end())
      found.push_back(include.file + " is in no part of CMakeLists.txt");
    else if (!part->second.count(used))
      found.push_back(include.file + " includes " + include.header + ", which " + part->first + " may not use");
  }
  return found;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

const char* const kSmall = R"(
  steadyhand_part(core LINK fmt::fmt)
  steadyhand_part(geometry/robot USES core LINK urdf)
  steadyhand_part(files/input USES core)
  steadyhand_part(planning/plan USES robot)
)";

TEST(Layering, NoIncludePointsUp) {
  std::vector<std::string> complaints;
  const Parts parts = read_parts(text_of(STEADYHAND_ROOT "/CMakeLists.txt"), complaints);
  ASSERT_TRUE(parts.count("core") && parts.count("operator/console")) << "CMakeLists.txt was not understood";
  const std::vector<Include> includes = read_includes(STEADYHAND_ROOT "/src");
  ASSERT_FALSE(includes.empty());
  EXPECT_EQ(joined(complaints), "");
  EXPECT_EQ(joined(violations(parts, includes)), "");
  EXPECT_EQ(joined(circles(parts)), "");
}

TEST(Layering, HackingHasARowForEachModuleThatNamesItsParts) {
  std::vector<std::string> complaints;
  const Parts parts = read_parts(text_of(STEADYHAND_ROOT "/CMakeLists.txt"), complaints);
  const std::string hacking = text_of(STEADYHAND_ROOT "/HACKING.md");
  std::set<std::string> modules;
  for (const auto& [path, allowed] : parts) {
    modules.insert(module_of(path));
    const std::size_t row = hacking.find("\n| `" + module_of(path) + "` |");
    ASSERT_NE(row, std::string::npos) << "HACKING.md's table has no row for " << module_of(path);
    const std::string words = hacking.substr(row, hacking.find('\n', row + 1) - row);
    EXPECT_NE(words.find("`" + path.substr(path.find('/') + 1) + "`"), std::string::npos)
        << path << " is not in " << words;
  }
  EXPECT_EQ(modules.size(), 10u);
}

TEST(Layering, AcceptsWhatIsUsedDirectlyOrThroughOthers) {
  std::vector<std::string> complaints;
  const Parts parts = read_parts(kSmall, complaints);
  EXPECT_EQ(joined(complaints), "");
  EXPECT_EQ(joined(violations(parts, {{"steadyhand/planning/plan/planner.hpp", "steadyhand/core/time.hpp"},
                                      {"steadyhand/planning/plan/inner/a.cpp", "steadyhand/planning/plan/planner.hpp"},
                                      {"steadyhand/apps/commands/main.cpp", "steadyhand/planning/plan/planner.hpp"}})),
            "");
  EXPECT_EQ(joined(circles(parts)), "");
}

TEST(Layering, RefusesAnArrowThatPointsUp) {
  std::vector<std::string> complaints;
  const Parts parts = read_parts(kSmall, complaints);
  EXPECT_EQ(violations(parts, {{"steadyhand/geometry/robot/model.cpp", "steadyhand/planning/plan/planner.hpp"}}).size(),
            1u);
  EXPECT_EQ(violations(parts, {{"steadyhand/core/time.hpp", "steadyhand/apps/commands/options.hpp"}}).size(), 1u);
}

TEST(Layering, RefusesANeighbourAndAFolderThatIsNoPart) {
  std::vector<std::string> complaints;
  const Parts parts = read_parts(kSmall, complaints);
  EXPECT_EQ(violations(parts, {{"steadyhand/planning/plan/a.cpp", "steadyhand/files/input/recording.hpp"}}).size(), 1u);
  EXPECT_EQ(violations(parts, {{"steadyhand/attic/box.cpp", "steadyhand/core/time.hpp"}}).size(), 1u);
}

TEST(Layering, AFacadeIncludesItsModuleAlone) {
  std::vector<std::string> complaints;
  const Parts parts = read_parts(kSmall, complaints);
  EXPECT_EQ(joined(violations(parts, {{"steadyhand/planning.hpp", "steadyhand/planning/plan/planner.hpp"}})), "");
  EXPECT_EQ(violations(parts, {{"steadyhand/planning.hpp", "steadyhand/geometry/robot/model.hpp"}}).size(), 1u);
}

TEST(Layering, RefusesAHeaderThatIsNotNamedFromTheRoot) {
  std::vector<std::string> complaints;
  const Parts parts = read_parts(kSmall, complaints);
  EXPECT_EQ(violations(parts, {{"steadyhand/planning/plan/planner.cpp", "plan/planner.hpp"}}).size(), 1u);
}

TEST(Layering, RefusesAPartThatUsesOneBelowAndACircleOfModules) {
  std::vector<std::string> complaints;
  read_parts("steadyhand_part(core USES robot)\nsteadyhand_part(geometry/robot USES core)", complaints);
  EXPECT_EQ(complaints.size(), 1u);
  EXPECT_EQ(
      circles(read_parts("steadyhand_part(a/one)\nsteadyhand_part(b/two USES one)\nsteadyhand_part(a/three USES two)",
                         complaints))
          .size(),
      2u);
}

TEST(Layering, ReadsTheIncludesOfAFile) {
  const fs::path src = fs::path(testing::TempDir()) / "layering" / "src";
  fs::remove_all(src);
  fs::create_directories(src / "steadyhand/core");
  std::ofstream(src / "steadyhand/core/a.hpp")
      << "#pragma once\n#include <vector>\n  # include \"steadyhand/planning/plan/b.hpp\"\n// \"x/y.hpp\"\n";
  const std::vector<Include> includes = read_includes(src);
  ASSERT_EQ(includes.size(), 1u);
  EXPECT_EQ(includes[0].file, "steadyhand/core/a.hpp");
  EXPECT_EQ(includes[0].header, "steadyhand/planning/plan/b.hpp");
}

}  // namespace
