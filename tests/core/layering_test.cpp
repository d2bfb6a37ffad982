// The house stands: no #include points up. CMakeLists.txt says which rooms a room uses; since all of src/ is one
// include root, the compiler would not notice a header of another room.
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
using Rooms = std::map<std::string, std::set<std::string>>;  ///< room -> rooms that its files may include

/// A file and what it includes, both as `steadyhand/ROOM/file.hpp`.
struct Include {
  std::string file, header;
};

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// Empty for a path that does not begin with `steadyhand/`: an installed header must not include it.
std::string room_of(const std::string& path) {
  const std::string root = "steadyhand/";
  return path.starts_with(root) ? path.substr(root.size(), path.find('/', root.size()) - root.size()) : "";
}

/// Reads `steadyhand_room(NAME USES a b LINK ...)`, top to bottom. A room may use itself and, through the rooms it
/// names, theirs; `app` and `python` everything. Naming a room that does not stand above is reported in `complaints`.
Rooms read_rooms(const std::string& cmake, std::vector<std::string>& complaints) {
  Rooms rooms;
  const std::regex call(R"(steadyhand_room\(\s*(\w+)([^)]*)\))");
  for (std::sregex_iterator it(cmake.begin(), cmake.end(), call), end; it != end; ++it) {
    const std::string name = (*it)[1];
    std::set<std::string> allowed = {name};
    std::istringstream words((*it)[2]);
    bool in_uses = false;
    for (std::string word; words >> word;) {
      if (word == "USES" || word == "LINK" || word == "TEST_LINK" || word == "EXCEPT" || word == "BARE") {
        in_uses = word == "USES";
      } else if (in_uses && !rooms.count(word)) {
        complaints.push_back("CMakeLists.txt: " + name + " uses " + word + ", which does not stand above it");
      } else if (in_uses) {
        allowed.insert(rooms[word].begin(), rooms[word].end());
      }
    }
    rooms[name] = allowed;
  }
  std::set<std::string> all = {"app"};
  for (const auto& [name, allowed] : rooms) all.insert(name);
  all.insert("python");
  rooms["app"] = rooms["python"] = all;
  return rooms;
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

std::vector<std::string> violations(const Rooms& rooms, const std::vector<Include>& includes) {
  std::vector<std::string> found;
  for (const Include& include : includes) {
    const auto room = rooms.find(room_of(include.file));
    if (room == rooms.end())
      found.push_back(include.file + " stands in no room of CMakeLists.txt");
    else if (!room->second.count(room_of(include.header)))
      found.push_back(include.file + " includes " + include.header + ", which " + room->first + " may not use");
  }
  return found;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

const char* const kSmallHouse = R"(
  steadyhand_room(core LINK fmt::fmt)
  steadyhand_room(robot USES core LINK urdf)
  steadyhand_room(input USES core)
  steadyhand_room(plan USES robot)
)";

TEST(Layering, NoIncludeOfTheHousePointsUp) {
  std::vector<std::string> complaints;
  const Rooms rooms = read_rooms(text_of(STEADYHAND_ROOT "/CMakeLists.txt"), complaints);
  ASSERT_TRUE(rooms.count("core") && rooms.count("console")) << "CMakeLists.txt was not understood";
  const std::vector<Include> includes = read_includes(STEADYHAND_ROOT "/src");
  ASSERT_FALSE(includes.empty());
  EXPECT_EQ(joined(complaints), "");
  EXPECT_EQ(joined(violations(rooms, includes)), "");
}

TEST(Layering, RoomsAreListedInHackingFromTopToBottom) {
  std::vector<std::string> complaints;
  const std::string cmake = text_of(STEADYHAND_ROOT "/CMakeLists.txt");
  const std::string hacking = text_of(STEADYHAND_ROOT "/HACKING.md");
  std::size_t last = 0;
  std::string previous = "the beginning";
  const std::regex call(R"(steadyhand_room\((\w+))");
  for (std::sregex_iterator it(cmake.begin(), cmake.end(), call), end; it != end; ++it) {
    const std::string name = (*it)[1];
    const std::size_t place = hacking.find("\n| `" + name + "` |");
    ASSERT_NE(place, std::string::npos) << "HACKING.md's table has no row for " << name;
    EXPECT_GT(place, last) << "in HACKING.md's table " << name << " must stand below " << previous;
    last = place;
    previous = name;
  }
}

TEST(Layering, AcceptsWhatIsUsedDirectlyOrThroughOthers) {
  std::vector<std::string> complaints;
  const Rooms rooms = read_rooms(kSmallHouse, complaints);
  EXPECT_EQ(joined(complaints), "");
  EXPECT_EQ(joined(violations(rooms, {{"steadyhand/plan/planner.hpp", "steadyhand/core/time.hpp"},
                                      {"steadyhand/plan/planner.cpp", "steadyhand/plan/planner.hpp"},
                                      {"steadyhand/app/main.cpp", "steadyhand/plan/planner.hpp"}})),
            "");
}

TEST(Layering, RefusesAnArrowThatPointsUp) {
  std::vector<std::string> complaints;
  const Rooms rooms = read_rooms(kSmallHouse, complaints);
  EXPECT_EQ(violations(rooms, {{"steadyhand/robot/model.cpp", "steadyhand/plan/planner.hpp"}}).size(), 1u);
  EXPECT_EQ(violations(rooms, {{"steadyhand/core/time.hpp", "steadyhand/app/options.hpp"}}).size(), 1u);
}

TEST(Layering, RefusesANeighbourAndAFolderThatIsNoRoom) {
  std::vector<std::string> complaints;
  const Rooms rooms = read_rooms(kSmallHouse, complaints);
  EXPECT_EQ(violations(rooms, {{"steadyhand/plan/planner.cpp", "steadyhand/input/recording.hpp"}}).size(), 1u);
  EXPECT_EQ(violations(rooms, {{"steadyhand/attic/box.cpp", "steadyhand/core/time.hpp"}}).size(), 1u);
}

TEST(Layering, RefusesAHeaderThatIsNotNamedFromTheRoot) {
  std::vector<std::string> complaints;
  const Rooms rooms = read_rooms(kSmallHouse, complaints);
  EXPECT_EQ(violations(rooms, {{"steadyhand/plan/planner.cpp", "plan/planner.hpp"}}).size(), 1u);
}

TEST(Layering, RefusesARoomThatUsesOneBelow) {
  std::vector<std::string> complaints;
  read_rooms("steadyhand_room(core USES robot)\nsteadyhand_room(robot USES core)", complaints);
  EXPECT_EQ(complaints.size(), 1u);
}

TEST(Layering, ReadsTheIncludesOfAFile) {
  const fs::path src = fs::path(testing::TempDir()) / "layering" / "src";
  fs::remove_all(src);
  fs::create_directories(src / "steadyhand/core");
  std::ofstream(src / "steadyhand/core/a.hpp")
      << "#pragma once\n#include <vector>\n  # include \"steadyhand/plan/b.hpp\"\n// \"x/y.hpp\"\n";
  const std::vector<Include> includes = read_includes(src);
  ASSERT_EQ(includes.size(), 1u);
  EXPECT_EQ(includes[0].file, "steadyhand/core/a.hpp");
  EXPECT_EQ(includes[0].header, "steadyhand/plan/b.hpp");
}

}  // namespace
