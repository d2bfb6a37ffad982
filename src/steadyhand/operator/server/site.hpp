#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// A file of the page as it goes out.
struct SiteFile {
  std::string body;
  std::string type;      ///< Content-Type
  bool gzipped = false;  ///< body is gzip; browsers unpack it
};

/// The page's files by path, "/index.html"; all in memory, so that a request never touches the disk.
class Site {
 public:
  /// The page that was built into the program.
  static Site embedded();
  /// Every file below `folder`. Errors: no folder, no index.html, more than 64 MB.
  static Result<Site> load(const std::filesystem::path& folder);

  /// A file more; one of the page's own at the same path stays.
  void add(const std::string& path, std::string body);

  /// "/" is "/index.html"; a query is ignored. nullptr: there is none.
  const SiteFile* find(std::string_view target) const;

 private:
  std::map<std::string, SiteFile, std::less<>> files_;
};

}  // namespace steadyhand
