#include "steadyhand/operator/server/site.hpp"

#include <array>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "steadyhand/operator/server/embedded_page.hpp"

namespace steadyhand {
namespace {

namespace fs = std::filesystem;

std::string type_of(const fs::path& path) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kTypes = {{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".glb", "model/gltf-binary"},
      {".wasm", "application/wasm"},
      {".woff2", "font/woff2"},
  }};
  for (const auto& [extension, type] : kTypes) {
    if (path.extension() == extension) return std::string(type);
  }
  return "application/octet-stream";
}

SiteFile make_file(fs::path name, std::string body) {
  SiteFile file{std::move(body), "", name.extension() == ".gz"};
  if (file.gzipped) name = name.stem();
  file.type = type_of(name);
  return file;
}

/// "a.js.gz" is served as "/a.js".
std::string address_of(const fs::path& name) {
  const std::string path = "/" + name.generic_string();
  return name.extension() == ".gz" ? path.substr(0, path.size() - 3) : path;
}

}  // namespace

Site Site::embedded() {
  Site site;
  for (const EmbeddedFile& file : embedded_page()) {
    const fs::path name = file.name;
    site.files_[address_of(name)] = make_file(name, std::string(file.begin, file.end));
  }
  return site;
}

Result<Site> Site::load(const fs::path& folder) {
  constexpr std::size_t kMaxBytes = 64u << 20;
  Site site;
  std::size_t bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (!it->is_regular_file(error)) continue;
    std::ifstream file(it->path(), std::ios::binary);
    std::string body{std::istreambuf_iterator<char>(file), {}};
    if (!file) return Error{it->path().string() + ": cannot be read"};
    bytes += body.size();
    if (bytes > kMaxBytes) return Error{folder.string() + ": more than 64 MB; is this the folder of a page?"};
    const fs::path name = it->path().lexically_relative(folder);
    site.files_[address_of(name)] = make_file(name, std::move(body));
  }
  if (error) return Error{folder.string() + ": " + error.message()};
  if (!site.find("/")) return Error{folder.string() + ": holds no index.html"};
  return site;
}

void Site::add(const std::string& path, std::string body) {
  if (!files_.contains(path)) files_[path] = make_file(path, std::move(body));
}

const SiteFile* Site::find(std::string_view target) const {
  target = target.substr(0, target.find_first_of("?#"));
  const auto found = files_.find(target == "/" ? std::string_view("/index.html") : target);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace steadyhand
