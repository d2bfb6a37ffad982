#pragma once

#include <string_view>
#include <vector>

namespace steadyhand {

/// A file that cmake/embed_folder.cmake put into the program.
struct EmbeddedFile {
  std::string_view name;  ///< below the folder, "assets/index.js.gz"
  const char* begin;
  const char* end;
};

/// The files of build/web. Generated.
std::vector<EmbeddedFile> embedded_page();

}  // namespace steadyhand
