#include "steadyhand/geometry/robot/urdf_text.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "steadyhand/core/text.hpp"
#include "steadyhand/geometry/robot/xacro.hpp"

namespace steadyhand {

namespace {

/// With a byte order mark, or as '<' begins in it.
bool is_utf16(std::string_view text) {
  using namespace std::string_view_literals;
  for (const std::string_view begin : {"\xff\xfe"sv, "\xfe\xff"sv, "<\0"sv, "\0<"sv}) {
    if (text.starts_with(begin)) return true;
  }
  return false;
}

}  // namespace

Result<UrdfText> read_urdf_text(const std::filesystem::path& file, Xacro xacro) {
  std::error_code error;
  if (file.empty()) return Error{"the path of the URDF is empty"};
  if (!std::filesystem::exists(file, error)) return Error{fmt::format("{}: no such file", file.string())};
  if (!std::filesystem::is_regular_file(file, error)) return Error{fmt::format("{} is not a file", file.string())};
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return Error{fmt::format("{} cannot be read", file.string())};
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    return Error{fmt::format("{} is empty: a URDF was expected", file.string())};
  }
  if (is_lfs_pointer(text)) return Error{fmt::format("{} {}", file.string(), kLfsPointer)};
  if (is_utf16(text)) {
    return Error{
        fmt::format("{0} is UTF-16; a URDF must be UTF-8: `iconv -f UTF-16 -t UTF-8 {0} > utf8.urdf`", file.string())};
  }
  const bool named = file.extension() == ".xacro";
  if (xacro == Xacro::kNever || (xacro == Xacro::kIfNamed && !named)) return UrdfText{std::move(text)};
  Result<std::string> expanded = expand_xacro(file);
  if (!expanded) return expanded.error();
  return UrdfText{*std::move(expanded), true};
}

}  // namespace steadyhand
