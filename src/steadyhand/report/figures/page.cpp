#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>

#include "steadyhand/report/figures/page_data.hpp"
#include "steadyhand/report/figures/report.hpp"

namespace steadyhand {

namespace embedded {
extern const std::string_view report_html;
}

Result<std::string> report_page(const ReportInput& input) {
  if (input.profiles.empty()) return Error{"a report needs at least one profile"};
  for (const ProfileResult& profile : input.profiles) {
    if (profile.steps.empty()) {
      return Error{fmt::format("profile {} has no planning steps to report", profile.name)};
    }
  }
  constexpr std::string_view kPlace = "{{data}}";
  const std::string_view page = embedded::report_html;
  const std::size_t at = page.find(kPlace);
  std::string filled(page.substr(0, at));
  filled += page_data(input, choose_thinning(input));
  return filled += page.substr(at + kPlace.size());
}

Status write_report(const ReportInput& input, const std::filesystem::path& path) {
  const Result<std::string> page = report_page(input);
  if (!page) return Error{path.string() + ": " + page.error().message};
  std::ofstream file(path, std::ios::binary);
  file << *page;
  file.close();
  if (!file) return Error{fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno))};
  return Done{};
}

}  // namespace steadyhand
