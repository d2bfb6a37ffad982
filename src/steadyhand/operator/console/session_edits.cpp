#include "steadyhand/operator/console/session_edits.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <system_error>

namespace steadyhand {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLongestLabel = 120;  ///< bytes

fs::path file_of(const fs::path& folder, const std::string& name, const char* extension) {
  return folder / (name + extension);
}

std::error_code last_error() { return {errno, std::generic_category()}; }

Error taken(const std::string& name) { return Error{fmt::format("there is a recording '{}' already", name)}; }
Error missing(const std::string& name) { return Error{fmt::format("there is no recording '{}'", name)}; }
Error cannot_change(const fs::path& path, const std::error_code& why) {
  return Error{fmt::format("{}: cannot be changed: {}", path.string(), why.message())};
}

/// The new label, or the old one: never a part.
std::error_code write_label(const fs::path& path, const std::string& text) {
  std::string draft = path.parent_path() / ("." + path.filename().string() + ".XXXXXX");  // no session's name
  const int file = mkstemp(draft.data());
  if (file < 0) return last_error();
  const std::string line = text + "\n";
  const bool written = write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size()) && fsync(file) == 0;
  std::error_code failed = written ? std::error_code() : last_error();
  if (close(file) != 0 && !failed) failed = last_error();
  if (!failed) fs::rename(draft, path, failed);
  if (failed) (void)unlink(draft.c_str());
  return failed;
}

/// The recording, then its label; both or none.
Status rename_session(const fs::path& folder, const std::string& name, const std::string& to) {
  const fs::path file = file_of(folder, name, ".mcap"), new_file = file_of(folder, to, ".mcap");
  const fs::path label = file_of(folder, name, ".label");
  if (const std::error_code failed = move_to_free_name(file, new_file)) {
    return failed == std::errc::file_exists                 ? taken(to)
           : failed == std::errc::no_such_file_or_directory ? missing(name)
                                                            : cannot_change(file, failed);
  }
  const std::error_code failed = move_to_free_name(label, file_of(folder, to, ".label"));
  if (!failed || failed == std::errc::no_such_file_or_directory) return Done{};  // most have none
  if (const std::error_code stays = move_to_free_name(new_file, file)) return cannot_change(new_file, stays);
  return cannot_change(label, failed);
}

}  // namespace

std::error_code move_to_free_name(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return {};
  return errno == EINVAL || errno == ENOSYS ? move_over_placeholder(from, to) : last_error();
}

std::error_code move_over_placeholder(const fs::path& from, const fs::path& to) {
  if (access(from.c_str(), F_OK) != 0) return last_error();
  const int placeholder = open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (placeholder < 0) return last_error();
  (void)close(placeholder);
  if (std::rename(from.c_str(), to.c_str()) == 0) return {};
  const std::error_code failed = last_error();
  (void)unlink(to.c_str());
  return failed;
}

bool is_session_name(const std::string& text) {
  const auto fits = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_' ||
           c == '.';
  };
  return !text.empty() && text.size() <= 128 && text.front() != '.' && std::all_of(text.begin(), text.end(), fits);
}

std::string session_label(const fs::path& folder, const std::string& name) {
  const fs::path path = file_of(folder, name, ".label");
  std::error_code failed;
  if (!fs::is_regular_file(path, failed)) return {};
  std::ifstream file(path);
  std::string label(kLongestLabel, '\0');
  file.read(label.data(), static_cast<std::streamsize>(label.size()));
  label.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
  return label.substr(0, label.find_first_of("\r\n"));
}

Status check_edit(const fs::path& folder, const SessionEdit& edit, const std::string& written) {
  std::error_code failed;
  if (!is_session_name(edit.name) || !fs::is_regular_file(file_of(folder, edit.name, ".mcap"), failed)) {
    return missing(edit.name);
  }
  if (edit.name == written && edit.kind != SessionEdit::Kind::kLabel) {
    return Error{fmt::format("'{}' is being recorded; end the recording first", edit.name)};
  }
  if (edit.kind == SessionEdit::Kind::kLabel && edit.to.size() > kLongestLabel) {
    return Error{fmt::format("a label has {} bytes; it may have {}", edit.to.size(), kLongestLabel)};
  }
  if (edit.kind != SessionEdit::Kind::kRename) return Done{};
  if (!is_session_name(edit.to)) {
    return Error{fmt::format("'{}' is no name for a recording: letters, digits, '-', '_' and '.', not first", edit.to)};
  }
  return fs::exists(file_of(folder, edit.to, ".mcap"), failed) ? Status(taken(edit.to)) : Done{};
}

Status carry_out(const fs::path& folder, const SessionEdit& edit) {
  std::error_code failed;
  const fs::path file = file_of(folder, edit.name, ".mcap"), label = file_of(folder, edit.name, ".label");
  switch (edit.kind) {
    case SessionEdit::Kind::kLabel:
      if (!fs::exists(file, failed)) return missing(edit.name);
      edit.to.empty() ? (void)fs::remove(label, failed) : (void)(failed = write_label(label, edit.to));
      return failed ? Status(cannot_change(label, failed)) : Done{};
    case SessionEdit::Kind::kRename:
      return rename_session(folder, edit.name, edit.to);
    case SessionEdit::Kind::kDelete:
      if (!fs::remove(file, failed)) return failed ? cannot_change(file, failed) : missing(edit.name);
      fs::remove(label, failed);
      return Done{};
  }
  return Done{};
}

}  // namespace steadyhand
