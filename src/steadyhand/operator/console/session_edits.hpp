#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <system_error>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Whether SessionRecorder or a user may give this name: nothing that leaves the folder.
bool is_session_name(const std::string& text);

/// The label that users gave a session; empty: none. It is stored next to the session's file, in NAME.label.
std::string session_label(const std::filesystem::path& folder, const std::string& name);

/// A change to a recorded session, checked but not carried out yet: a disk may take its time.
struct SessionEdit {
  enum class Kind { kLabel, kRename, kDelete };
  Kind kind = Kind::kLabel;
  std::string name;
  std::string to;  ///< kLabel: the label, empty for none; kRename: the new name
};

/// Why it cannot be done: no such session, a name that is none or is taken, or a session that is `written` now.
Status check_edit(const std::filesystem::path& folder, const SessionEdit& edit, const std::string& written);
/// Does it, unless what check_edit looked at has changed since; then nothing is lost. @pre check_edit
Status carry_out(const std::filesystem::path& folder, const SessionEdit& edit);

/// Renames a file to a name that no file has. A file that gets that name at the same time stays as it is, too.
/// @return std::errc::file_exists: there is one
std::error_code move_to_free_name(const std::filesystem::path& from, const std::filesystem::path& to);
/// The same for file systems that cannot do this in one step: an empty file takes the name first.
std::error_code move_over_placeholder(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace steadyhand
