#pragma once

#include <filesystem>
#include <system_error>
#include <vector>

namespace steadyhand {

/// The entries of a folder. If reading fails, returns those read until then; a loop over a directory_iterator would
/// throw.
inline std::vector<std::filesystem::directory_entry> entries_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::directory_entry> entries;
  std::error_code failed;
  for (std::filesystem::directory_iterator it(folder, failed), end; it != end; it.increment(failed)) {
    entries.push_back(*it);
  }
  return entries;
}

}  // namespace steadyhand
