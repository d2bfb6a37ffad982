#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Names that SessionRecorder gives, and that people may give: nothing that leaves the folder.
bool is_session_name(const std::string& text);

/// What people call a session; empty: nothing. It stands beside the session's file, in NAME.label.
std::string session_label(const std::filesystem::path& folder, const std::string& name);

/// What is to be done with a recorded session, looked at but not yet done: a disk may take its time.
struct SessionEdit {
  enum class Kind { kLabel, kRename, kDelete };
  Kind kind = Kind::kLabel;
  std::string name;
  std::string to;  ///< of kLabel the label, empty: none; of kRename the new name
};

/// Why it cannot be done: no such session, a name that is none or is taken, or a session that is `written` now.
Status check_edit(const std::filesystem::path& folder, const SessionEdit& edit, const std::string& written);
/// Does it. @pre check_edit
Status carry_out(const std::filesystem::path& folder, const SessionEdit& edit);

}  // namespace steadyhand
