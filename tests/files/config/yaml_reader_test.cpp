#include "steadyhand/files/config/yaml_reader.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "steadyhand/core/nearest.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

/// Reads `text` as a caller would; the error's message without the folder, or "" if there is none.
std::string error_of(const std::string& text, const std::function<void(YamlMap&)>& read) {
  const TemporaryFolder folder;
  const auto file = folder.write("file.yaml", text);
  auto map = YamlMap::open(file);
  if (!map) return map.error().message.substr(folder.path().string().size() + 1);
  read(*map);
  const Status status = map->finish();
  return status ? "" : status.error().message.substr(folder.path().string().size() + 1);
}

TEST(YamlMap, ReadsEveryKindOfValue) {
  const std::string text =
      "text: hello\nnumber: -1.5e-3\nplus: +2\ninteger: 7\nflag: true\nlist: [1, 2.5]\nmap: {a: 1}\n"
      "maps:\n  - {b: 2}\n  - {b: 3}\npairs: [[x, y]]\n";
  EXPECT_EQ(error_of(text,
                     [](YamlMap& map) {
                       EXPECT_EQ(map.text("text"), "hello");
                       EXPECT_EQ(map.number("number", Interval::any()), -1.5e-3);
                       EXPECT_EQ(map.number("plus", Interval::any()), 2.0);
                       EXPECT_EQ(map.integer("integer", 1, 10), 7);
                       EXPECT_TRUE(map.boolean("flag"));
                       EXPECT_EQ(map.numbers("list", Interval::any(), 2), (std::vector{1.0, 2.5}));
                       EXPECT_EQ(map.number_or_numbers("integer", Interval::any()), std::vector{7.0});
                       EXPECT_EQ(map.map("map").number("a", Interval::any()), 1.0);
                       auto maps = map.maps("maps");
                       ASSERT_EQ(maps.size(), 2u);
                       EXPECT_EQ(maps[0].number("b", Interval::any()), 2.0);
                       EXPECT_EQ(maps[1].number("b", Interval::any()), 3.0);
                       EXPECT_EQ(map.text_lists("pairs", 2), (std::vector<std::vector<std::string>>{{"x", "y"}}));
                       EXPECT_EQ(map.text("absent", "default"), "default");
                       EXPECT_EQ(map.number("absent", Interval::any(), 4.0), 4.0);
                       EXPECT_FALSE(map.optional_numbers("absent", Interval::any()));
                     }),
            "");
}

struct Mistake {
  const char* name;
  std::string text;
  std::function<void(YamlMap&)> read;
  std::string message;
};
void PrintTo(const Mistake& mistake, std::ostream* stream) { *stream << mistake.name; }
std::string mistake_name(const testing::TestParamInfo<Mistake>& mistake) { return mistake.param.name; }

class YamlMapRefuses : public testing::TestWithParam<Mistake> {};

TEST_P(YamlMapRefuses, WithFileLineAndWhatIsRight) {
  EXPECT_EQ(error_of(GetParam().text, GetParam().read), GetParam().message);
}

void read_a(YamlMap& map) { map.number("a", {0.0, 1.0, true}); }
void read_list(YamlMap& map) { map.numbers("a", Interval::any(), 3); }

INSTANTIATE_TEST_SUITE_P(
    All, YamlMapRefuses,
    testing::Values(
        Mistake{"empty", "", read_a, "file.yaml is empty"},
        Mistake{"only_comments", "# nothing\n", read_a, "file.yaml is empty"},
        Mistake{"list", "- 1\n", read_a, "file.yaml is a list; a mapping (key: value) is expected"},
        Mistake{"scalar", "hello", read_a, "file.yaml is a single value; a mapping (key: value) is expected"},
        Mistake{"two_documents", "a: 1\n---\na: 1\n", read_a, "file.yaml must contain exactly one YAML document"},
        Mistake{"comma_first", ", a: 1\n", read_a, "file.yaml must contain exactly one YAML document"},
        Mistake{"missing", "{}", read_a, "file.yaml:1: key 'a' is missing"},
        Mistake{"misspelt", "\nlateral: 1\nlaterel: 2\n", [](YamlMap& map) { map.number("lateral", Interval::any()); },
                "file.yaml:3: unknown key 'laterel'; did you mean 'lateral'? (known: lateral)"},
        Mistake{"misspelt_is_told_before_missing", "hmoe: 2\n", [](YamlMap& map) { map.text("home"); },
                "file.yaml:1: unknown key 'hmoe'; did you mean 'home'? (known: home)"},
        Mistake{"unknown_inside", "a: {b: 1, xyzzy: 2}",
                [](YamlMap& map) { map.map("a").number("b", Interval::any()); },
                "file.yaml:1: unknown key 'xyzzy' in 'a'; known: b"},
        Mistake{"twice", "a: 1\na: 0.5\n", read_a, "file.yaml:2: key 'a' is there twice"},
        Mistake{"word", "a: many\n", read_a, "file.yaml:1: a is 'many'; a number is expected"},
        Mistake{"unit", "a: 5 m\n", read_a, "file.yaml:1: a is '5 m'; a number is expected"},
        Mistake{"comma", "a: 0,5\n", read_a, "file.yaml:1: a is '0,5'; a number is expected"},
        Mistake{"nan", "a: nan\n", read_a, "file.yaml:1: a is 'nan'; it must be a finite number"},
        Mistake{"yaml_nan", "a: .nan\n", read_a, "file.yaml:1: a is '.nan'; a number is expected"},
        Mistake{"huge", "a: 1e999\n", read_a, "file.yaml:1: a is '1e999'; it must be a finite number"},
        Mistake{"no_value", "a:\n", read_a, "file.yaml:1: a is empty; give it a value or remove it"},
        Mistake{"outside", "a: 1.5\n", read_a, "file.yaml:1: a is 1.5; it must be more than 0 and at most 1"},
        Mistake{"open_end", "a: 0\n", read_a, "file.yaml:1: a is 0; it must be more than 0 and at most 1"},
        Mistake{"negative", "a: -1\n", [](YamlMap& map) { map.number("a", Interval::not_negative()); },
                "file.yaml:1: a is -1; it must be not negative"},
        Mistake{"list_for_number", "a: [1]\n", read_a, "file.yaml:1: a is a list; a number is expected"},
        Mistake{"short_list", "a: [1, 2]\n", read_list, "file.yaml:1: a has 2 numbers; 3 are expected"},
        Mistake{"bad_entry", "a:\n  - 1\n  - x\n  - 3\n", read_list, "file.yaml:3: a[1] is 'x'; a number is expected"},
        Mistake{"fraction", "a: 2.5\n", [](YamlMap& map) { map.integer("a", 0, 10); },
                "file.yaml:1: a is 2.5; it must be a whole number"},
        Mistake{"no_flag", "a: 1\n", [](YamlMap& map) { map.boolean("a"); },
                "file.yaml:1: a is '1'; true or false is expected"},
        Mistake{"map_expected", "a: 1\n", [](YamlMap& map) { map.map("a").number("b", Interval::any()); },
                "file.yaml:1: a is a single value; a mapping (key: value) is expected"},
        Mistake{"maps_expected", "a: [1]\n", [](YamlMap& map) { map.maps("a"); },
                "file.yaml:1: a[0] is a single value; a mapping is expected"},
        Mistake{"text_lists_expected", "a: [[x]]\n", [](YamlMap& map) { map.text_lists("a", 2); },
                "file.yaml:1: a[0] must be a list of 2 texts"},
        Mistake{"text_list_is_a_mapping", "a: [{x: y}]\n", [](YamlMap& map) { map.text_lists("a", 2); },
                "file.yaml:1: a[0] must be a list of 2 texts"}),
    mistake_name);

TEST(YamlMap, RefusesWhatIsNoYaml) {
  EXPECT_EQ(error_of("a: [1, 2\nb: 3\n", read_a).substr(0, 10), "file.yaml:");
  EXPECT_NE(error_of("a: [1, 2\nb: 3\n", read_a).find("not valid YAML"), std::string::npos);
  EXPECT_NE(error_of("a: *nowhere\n", read_a).find("not valid YAML"), std::string::npos);
  EXPECT_FALSE(error_of(std::string(5000, '['), read_a).empty());  // too deep for yaml-cpp: refused, no crash
}

TEST(Nearest, CountsEdits) {
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("same", "same"), 0);
}

}  // namespace
}  // namespace steadyhand
