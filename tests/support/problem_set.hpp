#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

/// A nonzero multiplier of a solution.
struct KeptMultiplier {
  int node;
  std::string constraint;
  int row;
  double value;
};

/// A problem of one arm with all that its solver was given, so that any version can be given the same again.
struct PosedProblem {
  std::string name;     ///< where it comes from; no blanks
  std::string profile;  ///< whose limits it has
  int horizon = 0;
  std::map<std::string, std::vector<double>> weights;
  OcpInstance instance;  ///< without weights, obstacles and liquid
  Trajectory guess;
  std::vector<KeptMultiplier> multipliers;  ///< none: a cold start
};

/// Text, a line for each problem: words and their numbers, which read back to the same bits.
inline void write(const PosedProblem& problem, std::ostream& out) {
  const auto add = [&](std::string_view words, const auto& numbers) {
    out << " " << words;
    for (const double number : numbers) out << fmt::format(" {}", number);
  };
  out << fmt::format("problem {} {} {}", problem.name, problem.profile, problem.horizon);
  for (const auto& [objective, weights] : problem.weights) {
    add(fmt::format("weights {} {}", objective, weights.size()), weights);
  }
  add("x0", problem.instance.x0);
  for (const JointVector& u : problem.guess.u) add("u", u);
  for (int k = 0; k < problem.horizon; ++k) {
    add("p", problem.instance.reference.tools[0].p[k]);
    add("R", problem.instance.reference.tools[0].R[k].reshaped());
  }
  for (const auto& [node, constraint, row, value] : problem.multipliers) {
    out << fmt::format(" multiplier {} {} {} {}", node, constraint, row, value);
  }
  out << " end\n";
}

/// @param dof of the arm
inline Result<std::vector<PosedProblem>> read_problem_set(const std::filesystem::path& path, int dof) {
  std::ifstream in(path);
  if (!in) return Error{fmt::format("{}: cannot be read", path.string())};
  std::vector<PosedProblem> all;
  const auto number = [&] {  // the stream's own reading of numbers does not round as they were written
    std::string text;
    in >> text;
    return std::strtod(text.c_str(), nullptr);
  };
  const auto fill = [&](auto&& numbers) {
    for (double& to : numbers) to = number();
  };
  std::string word;
  int inputs = 0, positions = 0, rotations = 0;
  while (in >> word) {
    if (word == "problem") {
      PosedProblem& problem = all.emplace_back();
      in >> problem.name >> problem.profile >> problem.horizon;
      if (problem.horizon < 1 || problem.horizon > kMaxHorizon) break;
      problem.guess = Trajectory(dof, problem.horizon);
      problem.instance.x0 = StateVector::Zero(2 * dof);
      problem.instance.reference.nodes = problem.horizon;
      inputs = positions = rotations = 0;
      continue;
    }
    if (all.empty()) break;
    PosedProblem& problem = all.back();
    Reference& reference = problem.instance.reference;
    if (word == "end") {
      if (inputs != problem.horizon || positions != inputs || rotations != inputs) break;
    } else if (word == "weights") {
      std::size_t count = 0;
      in >> word >> count;
      problem.weights[word].resize(count);
      fill(problem.weights[word]);
    } else if (word == "x0") {
      fill(problem.instance.x0);
    } else if (word == "u" && inputs < problem.horizon) {
      fill(problem.guess.u[inputs++]);
    } else if (word == "p" && positions < problem.horizon) {
      fill(reference.tools[0].p[positions++]);
    } else if (word == "R" && rotations < problem.horizon) {
      fill(reference.tools[0].R[rotations++].reshaped());
    } else if (word == "multiplier") {
      KeptMultiplier& kept = problem.multipliers.emplace_back();
      in >> kept.node >> kept.constraint >> kept.row;
      kept.value = number();
      if (kept.node < 0 || kept.node > problem.horizon) break;
    } else {
      break;
    }
    word.clear();
  }
  if (!in.eof() || word == "problem") {
    return Error{fmt::format("{}: '{}' of problem {} is not understood", path.string(), word, all.size())};
  }
  return all;
}

/// Those that the problem has rows for.
inline Multipliers kept_multipliers(const PosedProblem& problem, const Ocp& ocp) {
  Multipliers result;
  result.prepare(ocp);
  for (const auto& [node, name, row, value] : problem.multipliers) {
    for (int c = 0; c < std::ssize(ocp.constraints()); ++c) {
      const Constraint& constraint = *ocp.constraints()[c];
      if (constraint.name() == name && row < constraint.rows()) result.set(node, {c, row}, value);
    }
  }
  return result;
}

}  // namespace steadyhand
