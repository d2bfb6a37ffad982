#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

/// Fuzz targets: functions that take any bytes, must neither crash nor hang, and check what they promise with
/// `require`. With clang each is a separate libFuzzer program (preset `fuzz`); with any compiler, under any sanitizer,
/// `test_fuzz` replays the corpus.
namespace steadyhand::fuzz {

using Target = void (*)(std::string_view input);

/// All targets of this program by name.
inline std::map<std::string, Target>& targets() {
  static std::map<std::string, Target> all;
  return all;
}

struct Register {
  Register(const char* name, Target target) { targets()[name] = target; }
};

/// An invariant; a broken one ends the program, as a crash does.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz: broken: %s\n", what);
  std::abort();
}

/// A file in memory that holds the input; its path is good until the next one.
std::filesystem::path as_file(std::string_view content);

}  // namespace steadyhand::fuzz

/// FUZZ(name) { ... input ... }
#define FUZZ(name)                                                             \
  static void fuzz_##name(std::string_view input);                             \
  static const steadyhand::fuzz::Register register_##name(#name, fuzz_##name); \
  static void fuzz_##name(std::string_view input)
