#include "steadyhand/files/config/settings_table.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

struct Table : testing::Test {
  Table() {
    table.add("name", "of it", name);
    table.add("planner.rate", "Hz", "steps", rate, {4.0, 500.0}, "auto");
    table.add("planner.count", "", "of them", count, {1.0, 10.0});
    table.add("planner.solver", "which", solver, {"fatrop", "realtime"});
    table.add("gate.on", "whether", on);
  }
  Status load(const std::string& text) {
    std::ofstream(file) << text;
    return table.load(file);
  }
  std::string refused(const std::string& text) {
    const Status status = load(text);
    return status ? "accepted" : status.error().message;
  }

  TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "my.yaml";
  std::string name = "it", solver = "realtime";
  double rate = 0.0;
  unsigned count = 3;
  bool on = false;
  SettingsTable table;
};

TEST_F(Table, TakesWhatTheFileSaysAndKeepsTheRest) {
  ASSERT_TRUE(load("name: that\nplanner:\n  rate: 1e2\ngate: {on: true}\n"));
  EXPECT_EQ(name, "that");
  EXPECT_EQ(rate, 100.0);
  EXPECT_EQ(count, 3u);
  EXPECT_TRUE(on);
  EXPECT_EQ(table.origin("planner.rate"), file.string() + ":3");
  EXPECT_EQ(table.origin("planner.count"), "default");
  ASSERT_TRUE(table.set("planner.rate=auto"));
  EXPECT_EQ(rate, 0.0);
  EXPECT_EQ(table.origin("planner.rate"), "--set");
}

TEST_F(Table, WhatItPrintsReadsBack) {
  name = "it's a: strange # one";
  rate = 1.0 / 3.0 + 100.0;
  ASSERT_TRUE(table.set("gate.on", "true", "--gate"));
  const std::string text = table.format();
  EXPECT_NE(text.find("[--gate]"), std::string::npos) << text;
  const auto values = table.values();
  name = "other";
  rate = 7.0;
  on = false;
  ASSERT_TRUE(load(text)) << refused(text);
  EXPECT_EQ(name, "it's a: strange # one");
  EXPECT_EQ(rate, 1.0 / 3.0 + 100.0);
  EXPECT_TRUE(on);
  EXPECT_EQ(table.values(), values);
}

TEST_F(Table, RefusesWithFileLineAndWhatWouldBeRight) {
  struct Bad {
    const char *text, *line, *words;
  };
  const Bad bad[] = {
      {"planner:\n  rat: 5\n", ":2", "did you mean 'rate'"},
      {"planer:\n  rate: 5\n", ":1", "did you mean 'planner'"},
      {"name: x\nplanner:\n  rate: fast\n", ":3", "planner.rate is 'fast'; a number is expected, or 'auto'"},
      {"planner:\n  rate: nan\n", ":2", "finite"},
      {"planner:\n  rate: .inf\n", ":2", "number"},
      {"planner:\n  rate: 501\n", ":2", "at most 500"},
      {"planner:\n  rate: -1\n", ":2", "at least 4"},
      {"planner:\n  rate: [5]\n", ":2", "list"},
      {"planner:\n  rate:\n", ":2", "empty"},
      {"planner: 5\n", ":1", "mapping"},
      {"planner:\n  count: 2.5\n", ":2", "whole"},
      {"planner:\n  solver: magic\n", ":2", "fatrop, realtime"},
      {"gate:\n  on: yes\n", ":2", "true or false"},
      {"gate:\n  on: true\n  on: false\n", ":3", "twice"}};
  for (const Bad& each : bad) {
    const std::string message = refused(each.text);
    EXPECT_NE(message.find(file.string() + each.line + ":"), std::string::npos) << message;
    EXPECT_NE(message.find(each.words), std::string::npos) << message;
  }
  EXPECT_EQ(rate, 0.0);
}

TEST_F(Table, RefusesOnTheCommandLineToo) {
  for (const char* assignment : {"planner.rate", "planner.rat=5", "planner.rate=", "planner.rate=1e999", "=", ""}) {
    EXPECT_FALSE(table.set(assignment)) << assignment;
  }
  const Status status = table.set("gate.on", "maybe", "--gate");
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("--gate: gate.on is 'maybe'"), std::string::npos) << status.error().message;
  EXPECT_NE(table.set("gat.on=true").error().message.find("did you mean 'gate.on'"), std::string::npos);
}

}  // namespace
}  // namespace steadyhand
