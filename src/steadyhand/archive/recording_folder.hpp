#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace steadyhand {

/// Whether SessionRecorder gives this name to recordings of whole sessions: DATE_TIME.mcap or DATE_TIME_2.mcap, not
/// those of faults, nor any file of somebody else's.
bool is_recording_name(std::string_view name);

/// What was deleted.
struct Pruned {
  int files = 0;
  std::uintmax_t bytes = 0;
  std::string newest;  ///< name of the newest that was deleted
};

/// Deletes the oldest recordings of whole sessions until all of them in the folder have at most `most` bytes. Stays
/// clear of `keep` and of what was written to in the last minute: another session may be recording. Files that cannot
/// be deleted stay.
Pruned prune_recordings(const std::filesystem::path& folder, std::uintmax_t most, const std::filesystem::path& keep);

}  // namespace steadyhand
