#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

/// The liquid of a problem, and where it is at node 0.
struct LiquidRecord {
  LiquidSettings settings;
  bool counts = true;
  double room = 0.0;  ///< m, as LiquidInstance has it
  SloshState state = SloshState::Zero();
};

/// One problem as `steadyhand solve` reads it: docs/explanation/formulation.md gives the JSON.
struct ProblemRecord {
  std::string robot;
  double dt = 0.05;  ///< s
  int horizon = 8;
  StateVector x0;
  Weights weights;
  Reference reference;
  JointVector position_margin;                  ///< rad (m), as OcpSettings has it
  NearObstacles near;                           ///< those that a row is for
  JointVector u_followed;                       ///< rad/s^2, as OcpInstance has it
  double clearance = 0.0;                       ///< m, the same
  std::optional<ReferencePoseOf<double>> held;  ///< the same
  JointSet given;                               ///< the same
  int tools = 1;                                ///< how many have a reference
  std::vector<LiquidRecord> liquid;             ///< of each tool, or none
  std::optional<Trajectory> guess;
  double tolerance = 1e-6;
};

struct ProblemFile {
  std::vector<ProblemRecord> problems;
  bool is_array = false;  ///< the answer has the same form
};

/// Reads one problem or an array of them. Refuses, naming file and key: what is no JSON, unknown or missing keys, wrong
/// types and sizes, numbers that are not finite or out of range, references that are no rotations.
Result<ProblemFile> read_problems(const std::filesystem::path& path);
/// The same of a text. @param name begins the messages, if it is not empty
Result<ProblemFile> parse_problems(std::string_view text, const std::string& name);

/// The problem that a planner solved.
ProblemRecord to_record(const Ocp& ocp, const OcpInstance& instance, const Trajectory& guess, double tolerance);
/// Writes an array of problems, each in the form that read_problems takes.
Status write_problems(const std::vector<ProblemRecord>& problems, const std::filesystem::path& path);

/// {"status", "objective", "iterations", "time_us", "kkt_error", "x", "u"} in one line.
std::string to_json(const Solution& solution);

}  // namespace steadyhand
