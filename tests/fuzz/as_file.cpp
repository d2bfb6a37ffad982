#include <sys/mman.h>
#include <unistd.h>

#include "fuzz/fuzz.hpp"

namespace steadyhand::fuzz {

std::filesystem::path as_file(std::string_view content) {
  static const int descriptor = memfd_create("fuzz", 0);
  require(descriptor >= 0 && ftruncate(descriptor, 0) == 0, "a file in memory");
  require(pwrite(descriptor, content.data(), content.size(), 0) == static_cast<ssize_t>(content.size()), "its content");
  return "/proc/self/fd/" + std::to_string(descriptor);
}

}  // namespace steadyhand::fuzz
