#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "steadyhand/files/archive/recording_place.hpp"

namespace steadyhand {

struct RecordingFolderSettings {
  std::filesystem::path path;  ///< empty: default_session_folder()
  double keep_free_gb = 1.0;   ///< GB that stay free on the disk: with less, no file begins, and the one at hand ends
  double max_gb = 0.0;         ///< GB of recordings in the folder, beyond which the oldest go; 0: all stay
};

/// $XDG_DATA_HOME/steadyhand/sessions, by default ~/.local/share/steadyhand/sessions.
std::filesystem::path default_session_folder();

/// Whether SessionRecorder gives this name to recordings of whole sessions: DATE_TIME.mcap or DATE_TIME_2.mcap, not
/// those of faults, nor files of other programs.
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

/// Recordings as files, NAME.mcap.
class RecordingFolder final : public RecordingPlace {
 public:
  explicit RecordingFolder(const RecordingFolderSettings& settings);

  Result<Opened> open(const std::function<std::string(int)>& numbered) override;
  /// Makes the folder where there is none.
  std::string no_room() override;
  std::string make_room(const Opened& newest) override;
  bool is_gone(const Opened& opened) override;

 private:
  RecordingFolderSettings settings_;
};

}  // namespace steadyhand
