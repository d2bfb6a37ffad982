#pragma once

#include <memory>
#include <string>
#include <vector>

namespace steadyhand::urscript {

enum class Kind {
  // statements
  kBlock,
  kFunction,
  kIf,
  kWhile,
  kAssign,
  kReturn,
  kBreak,
  kContinue,
  kHalt,
  kEnter,
  kExit,
  kKill,
  kJoin,
  kExpression,
  // expressions
  kNumber,
  kText,
  kTrue,
  kFalse,
  kName,
  kList,
  kIndex,
  kCall,
  kRun,
  kUnary,
  kBinary,
};

struct Node {
  Kind kind{};
  int line = 0;
  std::string text;  ///< name, operator, text; of kAssign: "global", "local" or none
  double number = 0.0;
  std::vector<std::unique_ptr<Node>> parts;   ///< operands; of kFunction and kWhile: body
  std::vector<std::unique_ptr<Node>> blocks;  ///< kIf: condition and body in turn, at last perhaps a body alone
  std::vector<std::string> names;             ///< parameters, or names of arguments (empty: by position)
};

/// The program's functions, as a kBlock. Throws ScriptError.
std::unique_ptr<Node> parse(const std::string& source);

}  // namespace steadyhand::urscript
