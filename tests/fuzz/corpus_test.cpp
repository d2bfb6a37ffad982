// The corpus, input by input and with random edits: crashes once found stay fixed, with any compiler and sanitizer.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "fuzz/fuzz.hpp"

namespace steadyhand::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr int kEdits = 200;    // for each input ...
constexpr int kFewEdits = 10;  // ... whose target takes tens of ms: DDS sets up and takes down
constexpr double kSlow = 5.0;  // s for one input; under a sanitizer on a busy machine

const fs::path kCorpus = fs::path(STEADYHAND_ROOT) / "tests/fuzz/corpus";

std::vector<std::string> inputs_of(const std::string& target) {
  std::vector<std::string> inputs;
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(kCorpus / target)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const fs::path& path : paths) {
    std::ifstream stream(path, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  }
  return inputs;
}

/// A few bytes changed, cut, doubled, or taken from another input.
std::string edited(std::string text, const std::vector<std::string>& others, std::mt19937& random) {
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  for (std::size_t edits = 1 + pick(4); edits > 0; --edits) {
    const std::size_t at = pick(text.size() + 1);
    const std::string& other = others[pick(others.size())];
    const std::size_t from = pick(other.size() + 1);
    switch (pick(5)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(random());
        break;
      case 1:
        text.erase(at, pick(9) + 1);
        break;
      case 2:
        text.insert(at, text.substr(pick(text.size() + 1), pick(30)));
        break;
      case 3:
        text.insert(at, other.substr(from, pick(30)));
        break;
      default:
        text.insert(at, pick(2) ? "-1e308" : "nan");
    }
  }
  return text;
}

class Corpus : public testing::TestWithParam<std::string> {};

TEST_P(Corpus, IsReadWithoutHarmAlsoWithRandomEdits) {
  const Target target = targets().at(GetParam());
  const std::vector<std::string> inputs = inputs_of(GetParam());
  ASSERT_GE(inputs.size(), 2u);
  std::mt19937 random(1);
  const int edits = GetParam() == "cdr" ? kFewEdits : kEdits;
  for (const std::string& input : inputs) {
    target(input);
    for (int i = 0; i < edits; ++i) {
      const auto begin = std::chrono::steady_clock::now();
      target(edited(input, inputs, random));
      EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), kSlow);
    }
  }
}

std::vector<std::string> names() {
  std::vector<std::string> names;
  for (const auto& [name, target] : targets()) names.push_back(name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Parsers, Corpus, testing::ValuesIn(names()), [](const auto& each) { return each.param; });

TEST(Corpora, BelongToTargets) {
  for (const auto& entry : fs::directory_iterator(kCorpus)) {
#ifndef STEADYHAND_ROS2
    if (entry.path().filename() == "cdr") continue;
#endif
    EXPECT_TRUE(targets().contains(entry.path().filename().string())) << entry.path();
  }
}

}  // namespace
}  // namespace steadyhand::fuzz
