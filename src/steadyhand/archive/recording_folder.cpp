#include "steadyhand/archive/recording_folder.hpp"

#include <algorithm>
#include <chrono>
#include <system_error>
#include <vector>

namespace steadyhand {

namespace fs = std::filesystem;

bool is_recording_name(std::string_view name) {
  constexpr std::string_view kDate = "dddd-dd-dd_dd-dd-dd", kEnd = ".mcap";  // d: a digit
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (name.size() < kDate.size() + kEnd.size() || name.substr(name.size() - kEnd.size()) != kEnd) return false;
  for (std::size_t i = 0; i < kDate.size(); ++i) {
    if (kDate[i] == 'd' ? !is_digit(name[i]) : name[i] != kDate[i]) return false;
  }
  const std::string_view rest = name.substr(kDate.size(), name.size() - kDate.size() - kEnd.size());
  return rest.empty() || (rest.size() > 1 && rest[0] == '_' && std::all_of(rest.begin() + 1, rest.end(), is_digit));
}

Pruned prune_recordings(const fs::path& folder, std::uintmax_t most, const fs::path& keep) {
  struct File {
    fs::path path;
    std::uintmax_t bytes = 0;
    bool old = false;
  };
  std::vector<File> files;
  std::uintmax_t total = 0;
  std::error_code failed;
  const auto lately = fs::file_time_type::clock::now() - std::chrono::minutes(1);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed)) {
    std::error_code gone;
    if (!is_recording_name(entry.path().filename().string()) || !entry.is_regular_file(gone)) continue;
    const std::uintmax_t bytes = entry.file_size(gone);
    const fs::file_time_type written = entry.last_write_time(gone);
    if (gone) continue;
    files.push_back({entry.path(), bytes, written < lately && entry.path().filename() != keep.filename()});
    total += bytes;
  }
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) { return a.path < b.path; });  // by date
  Pruned pruned;
  for (const File& file : files) {
    if (total <= most) break;
    std::error_code refused;
    if (!file.old || !fs::remove(file.path, refused)) continue;
    total -= file.bytes;
    pruned.bytes += file.bytes;
    pruned.newest = file.path.filename().string();
    ++pruned.files;
  }
  return pruned;
}

}  // namespace steadyhand
