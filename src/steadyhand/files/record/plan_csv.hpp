#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/record/step.hpp"

namespace steadyhand {

/// Writes plan.csv: a header whose names carry the units, then one row per planning step. Numbers are the shortest that
/// read back the same, so equal runs give equal files except for the column solve_time_us.
class PlanCsvWriter {
 public:
  /// Creates or replaces the file and writes the header.
  static Result<PlanCsvWriter> create(const std::filesystem::path& path, const RunNames& names);

  Status write(const PlanStep& step);
  /// Completes the file; nothing can be written afterwards.
  Status close();

 private:
  struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  PlanCsvWriter(const std::filesystem::path& path, const RunNames& names, std::FILE* file);
  Status put(const char* data, std::size_t size);

  std::filesystem::path path_;
  RunNames names_;
  std::unique_ptr<std::FILE, FileCloser> file_;
};

/// The header line of plan.csv, without line end.
std::string plan_csv_header(const RunNames& names);

}  // namespace steadyhand
