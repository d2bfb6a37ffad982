#include "steadyhand/files/record/plan_csv.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <iterator>

namespace steadyhand {
namespace {

/// One line of comma-separated fields.
class Row {
 public:
  template <typename Value>
  void add(const Value& value) {
    if (line_.size() > 0) line_.push_back(',');
    fmt::format_to(std::back_inserter(line_), "{}", value);
  }
  template <typename Vector>
  void add_all(const Vector& values) {
    for (int i = 0; i < values.size(); ++i) add(values[i]);
  }
  void add_pose(const Pose& pose) {
    add_all(pose.p);
    add_all(pose.q.coeffs());  // x, y, z, w
  }
  void end() { line_.push_back('\n'); }
  const fmt::memory_buffer& line() const { return line_; }

 private:
  fmt::memory_buffer line_;
};

/// `of`: goes before names.
void add_pose_names(Row& row, const std::string& of) {
  for (const std::string pose : {"target", "planned"}) {
    for (const char axis : {'x', 'y', 'z'}) row.add(fmt::format("{}{}_{}_m", of, pose, axis));
    for (const char axis : {'x', 'y', 'z', 'w'}) row.add(fmt::format("{}{}_q{}", of, pose, axis));
  }
}
void add_acceleration_names(Row& row, const std::string& of) {
  for (const char axis : {'x', 'y', 'z'}) row.add(fmt::format("{}local_acceleration_{}_m_s2", of, axis));
}

}  // namespace

std::string plan_csv_header(const RunNames& names) {
  const auto of = [&](int tool) { return names.tool_count() > 1 ? names.tools[tool] + "_" : std::string(); };
  Row row;
  row.add("t_s");
  add_pose_names(row, of(0));
  for (const auto& [symbol, per] : {std::pair{"q", ""}, {"dq", "_s"}, {"ddq", "_s2"}}) {
    for (std::size_t i = 0; i < names.joint_units.size(); ++i) {
      row.add(fmt::format("{}{}_{}{}", symbol, i, names.joint_units[i], per));
    }
  }
  add_acceleration_names(row, of(0));
  row.add("objective");
  for (const std::string& term : names.terms) row.add("objective_" + term);
  for (const char* name : {"iterations", "solve_time_us", "status", "smallest_sphere_distance_m"}) row.add(name);
  row.add(of(0) + "engaged");
  for (int tool = 1; tool < names.tool_count(); ++tool) {
    add_pose_names(row, of(tool));
    add_acceleration_names(row, of(tool));
    row.add(of(tool) + "engaged");
  }
  if (names.tool_count() > 1) row.add("distance_between_arms_m");
  return fmt::to_string(row.line());
}

PlanCsvWriter::PlanCsvWriter(const std::filesystem::path& path, const RunNames& names, std::FILE* file)
    : path_(path), names_(names), file_(file) {}

Result<PlanCsvWriter> PlanCsvWriter::create(const std::filesystem::path& path, const RunNames& names) {
  if (names.terms.size() > kMaxObjectives) {
    return Error{fmt::format("{}: {} objective terms; at most {} can be recorded", path.string(), names.terms.size(),
                             kMaxObjectives)};
  }
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) return Error{fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno))};
  PlanCsvWriter writer(path, names, file);
  const std::string header = plan_csv_header(names) + "\n";
  if (Status status = writer.put(header.data(), header.size()); !status) return status.error();
  return writer;
}

Status PlanCsvWriter::put(const char* data, std::size_t size) {
  if (std::fwrite(data, 1, size, file_.get()) == size) return Done{};
  return Error{fmt::format("{}: writing failed: {}", path_.string(), std::strerror(errno))};
}

Status PlanCsvWriter::write(const PlanStep& step) {
  const auto n = static_cast<Eigen::Index>(names_.joint_units.size());
  if (step.q.size() != n || step.dq.size() != n || step.ddq.size() != n) {
    return Error{fmt::format("{}: a step with {}, {} and {} joint values; it must have {} each", path_.string(),
                             step.q.size(), step.dq.size(), step.ddq.size(), n)};
  }
  Row row;
  row.add(step.t_s);
  row.add_pose(step.tools[0].X_base_target);
  row.add_pose(step.tools[0].X_base_planned);
  row.add_all(step.q);
  row.add_all(step.dq);
  row.add_all(step.ddq);
  row.add_all(step.tools[0].local_acceleration);
  row.add(step.objective);
  for (std::size_t i = 0; i < names_.terms.size(); ++i) row.add(step.shares[i]);
  row.add(step.iterations);
  row.add(step.solve_time_us);
  row.add(to_string(step.status));
  row.add(step.smallest_sphere_distance_m);
  row.add(step.tools[0].engaged ? 1 : 0);
  for (int t = 1; t < names_.tool_count(); ++t) {
    row.add_pose(step.tools[t].X_base_target);
    row.add_pose(step.tools[t].X_base_planned);
    row.add_all(step.tools[t].local_acceleration);
    row.add(step.tools[t].engaged ? 1 : 0);
  }
  if (names_.tool_count() > 1) row.add(step.distance_between_arms_m);
  row.end();
  return put(row.line().data(), row.line().size());
}

Status PlanCsvWriter::close() {
  if (!file_) return Done{};
  if (std::fclose(file_.release()) == 0) return Done{};
  return Error{fmt::format("{}: writing failed: {}", path_.string(), std::strerror(errno))};
}

}  // namespace steadyhand
