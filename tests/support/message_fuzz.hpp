#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

namespace steadyhand {

/// Messages of docs/reference/protocol.md with a few random edits, and some without any. The same seed gives the same
/// ones.
class MessageFuzz {
 public:
  explicit MessageFuzz(std::uint32_t seed) : random_(seed) {}

  std::string next() {
    static const std::array<std::string, 12> kSeeds = {
        R"({"type":"hello","version":3})",
        R"({"type":"take"})",
        R"({"type":"release"})",
        R"({"type":"pair","code":"hdkmxcrtbnpq"})",
        R"({"type":"sample","sequence":3,"t_s":2.5,"p":[0,0,1],"q":[0,0,0,1],"clutch":true,"tracked":true,"emulated":false,"tool":1})",
        R"({"type":"ask"})",
        R"({"type":"answer","grant":false})",
        R"({"type":"request","kind":"stop"})",
        R"({"type":"request","kind":"profile","text":"tracking"})",
        R"({"type":"request","kind":"reset"})",
        R"({"type":"ping","t_s":3,"echo_s":1,"held_s":0})",
        R"({"type":"request","kind":"weight","text":"lateral","value":3})"};
    std::string text = kSeeds[pick(kSeeds.size())];
    for (std::size_t edits = pick(4); edits > 0 && !text.empty(); --edits) {
      const std::size_t at = pick(text.size());
      switch (pick(4)) {
        case 0:
          text[at] = static_cast<char>(random_());
          break;
        case 1:
          text.erase(at, pick(8) + 1);
          break;
        case 2:
          text.insert(at, text.substr(pick(text.size()), pick(12)));
          break;
        default:
          text.insert(at, pick(2) ? "1e308" : "[[[{\"a\":");
          break;
      }
    }
    return text;
  }

 private:
  std::size_t pick(std::size_t n) { return static_cast<std::size_t>(random_() % n); }
  std::mt19937 random_;
};

}  // namespace steadyhand
