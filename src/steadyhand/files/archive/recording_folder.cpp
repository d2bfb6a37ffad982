#include "steadyhand/files/archive/recording_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <system_error>
#include <vector>

#include "steadyhand/core/folder.hpp"
#include "steadyhand/files/record/mcap_writer.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

fs::path default_session_folder() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return fs::path(value == nullptr ? "" : value);
  };
  fs::path data = variable("XDG_DATA_HOME");
  if (!data.is_absolute() && variable("HOME").is_absolute()) data = variable("HOME") / ".local/share";
  return data.is_absolute() ? data / "steadyhand/sessions" : fs::path("sessions");
}

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
  const auto lately = fs::file_time_type::clock::now() - std::chrono::minutes(1);
  for (const fs::directory_entry& entry : entries_of(folder)) {
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

RecordingFolder::RecordingFolder(const RecordingFolderSettings& settings) : settings_(settings) {
  if (settings_.path.empty()) settings_.path = default_session_folder();
}

Result<RecordingPlace::Opened> RecordingFolder::open(const std::function<std::string(int)>& numbered) {
  std::error_code failed;
  fs::create_directories(settings_.path, failed);
  for (int i = 1;; ++i) {  // this session's earlier files, and another that began in the same second
    const std::string name = numbered(i);
    const fs::path path = settings_.path / (name + ".mcap");
    auto file = open_mcap_file(path, {.replace = false});
    if (!file && fs::exists(path, failed)) continue;
    if (!file) return file.error();
    return Opened{name, path.string(), *std::move(file)};
  }
}

std::string RecordingFolder::no_room() {
  std::error_code failed;
  fs::create_directories(settings_.path, failed);
  if (failed) return fmt::format("{}: cannot be made: {}", settings_.path.string(), failed.message());
  const fs::space_info space = fs::space(settings_.path, failed);
  const double free_gb = 1e-9 * static_cast<double>(space.available);
  if (failed || free_gb >= settings_.keep_free_gb) return {};
  return fmt::format("{}: {:.1f} GB are free on its disk, and {} GB are to stay so", settings_.path.string(), free_gb,
                     settings_.keep_free_gb);
}

std::string RecordingFolder::make_room(const Opened& newest) {
  if (settings_.max_gb <= 0.0) return {};
  const Pruned pruned =
      prune_recordings(settings_.path, static_cast<std::uintmax_t>(1e9 * settings_.max_gb), newest.where);
  if (pruned.files == 0) return {};
  return fmt::format(
      "deleted the {} oldest recordings, up to {} ({:.1f} GB): {} may have at most {} GB "
      "(recording.folder_max)",
      pruned.files, pruned.newest, 1e-9 * static_cast<double>(pruned.bytes), settings_.path.string(), settings_.max_gb);
}

bool RecordingFolder::is_gone(const Opened& opened) {
  std::error_code failed;
  return !fs::exists(opened.where, failed) && !failed;
}

}  // namespace steadyhand
