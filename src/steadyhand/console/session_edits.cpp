#include "steadyhand/console/session_edits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <system_error>

namespace steadyhand {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLongestLabel = 120;  ///< bytes

fs::path file_of(const fs::path& folder, const std::string& name, const char* extension) {
  return folder / (name + extension);
}

}  // namespace

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
    return Error{fmt::format("there is no recording '{}'", edit.name)};
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
  if (fs::exists(file_of(folder, edit.to, ".mcap"), failed)) {
    return Error{fmt::format("there is a recording '{}' already", edit.to)};
  }
  return Done{};
}

Status carry_out(const fs::path& folder, const SessionEdit& edit) {
  std::error_code failed;
  const auto error = [&](const fs::path& path) {
    return Error{fmt::format("{}: cannot be changed: {}", path.string(), failed.message())};
  };
  const fs::path file = file_of(folder, edit.name, ".mcap"), label = file_of(folder, edit.name, ".label");
  switch (edit.kind) {
    case SessionEdit::Kind::kLabel:
      if (edit.to.empty()) {
        fs::remove(label, failed);
      } else if (std::ofstream out(label); !(out << edit.to << "\n").flush()) {
        failed = std::make_error_code(std::errc::io_error);
      }
      return failed ? Status(error(label)) : Status(Done{});
    case SessionEdit::Kind::kRename:
      fs::rename(file, file_of(folder, edit.to, ".mcap"), failed);
      if (failed) return error(file);
      fs::rename(label, file_of(folder, edit.to, ".label"), failed);  // most have none
      return Done{};
    case SessionEdit::Kind::kDelete:
      fs::remove(file, failed);
      if (failed) return error(file);
      fs::remove(label, failed);
      return Done{};
  }
  return Done{};
}

}  // namespace steadyhand
