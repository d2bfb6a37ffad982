#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

/// An interpreter for the part of URScript that set-point programs are made of: functions, threads, control flow,
/// numbers, lists, text, and what the host gives by name. Not there: matrices, structs, remote calls, secondary
/// programs, interpreter mode, poses as more than lists of six; integers are floating-point numbers.
namespace steadyhand::urscript {

struct Value;
using List = std::vector<Value>;
struct Value : std::variant<std::monostate, bool, double, std::string, List> {
  using variant::variant;
};

/// A program that cannot be parsed or run on. The message names the line.
struct ScriptError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

double number(const Value& value);
bool truth(const Value& value);
const List& list(const Value& value);
std::string text(const Value& value);

/// Arguments of a call of the host: by position or, as URScript has it, by name.
struct Arguments {
  List values;
  std::map<std::string, Value> named;
  /// The i-th, or the one with that name, or `otherwise`.
  Value get(std::size_t i, const std::string& name, const Value& otherwise) const;
};

/// Operations of a host function on the thread that calls it.
class Waiting {
 public:
  virtual ~Waiting() = default;
  /// Returns in the next control cycle.
  virtual void next_cycle() = 0;
};
using Builtin = std::function<Value(const Arguments&, Waiting&)>;
using Builtins = std::map<std::string, Builtin>;

struct Node;

/// A program that runs a control cycle at a time; each of its threads runs until it waits for the next cycle.
class Program {
 public:
  /// Parses; throws ScriptError. @param builtins must outlive it @param budget what a thread may evaluate in a cycle
  /// (expressions and statements, each with its parts); if it needs more, it continues in the next; 0: no limit
  Program(const std::string& source, const Builtins& builtins, int budget = 0);
  ~Program();

  const std::string& name() const { return name_; }
  /// One control cycle. False: it has ended; error() says whether by itself.
  bool cycle();
  const std::string& error() const { return error_; }
  /// Most that a thread evaluated in a cycle, and how often it wanted more than the budget.
  int largest_effort() const { return largest_effort_; }
  int overruns() const { return overruns_; }
  /// Evaluations of the program itself, not its threads, in the last cycle.
  int effort() const { return effort_; }

 private:
  class Fiber;
  using Scope = std::map<std::string, Value>;
  enum class Flow { kNext, kBreak, kContinue, kReturn };

  void start(const std::string& function, List arguments);
  Value call(Fiber& fiber, const Node& definition, const List& arguments);
  Flow run(Fiber& fiber, const std::vector<std::unique_ptr<Node>>& block, Scope& scope, Value& result);
  Flow run(Fiber& fiber, const Node& statement, Scope& scope, Value& result);
  Value evaluate(Fiber& fiber, const Node& expression, Scope& scope);
  Value evaluate_call(Fiber& fiber, const Node& expression, Scope& scope);
  Value& variable(const Node& name, Scope& scope, bool create);
  void spend(Fiber& fiber);

  const Builtins* builtins_;
  std::string name_;
  std::unique_ptr<Node> root_;
  std::map<std::string, const Node*> functions_;
  Scope globals_;
  std::vector<std::unique_ptr<Fiber>> fibers_;  ///< [0] is the program itself; a thread's value is its index
  Fiber* critical_ = nullptr;                   ///< between enter_critical and exit_critical
  bool halted_ = false;
  int budget_ = 0, effort_ = 0, largest_effort_ = 0, overruns_ = 0;
  std::string error_;
};

}  // namespace steadyhand::urscript
