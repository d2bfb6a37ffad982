#include "support/ur/urscript.hpp"

#include <ucontext.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#endif

#include "support/ur/urscript_parser.hpp"

namespace steadyhand::urscript {

namespace {

/// Statements that a thread may run in one cycle; real controllers give it a share of the cycle's time.
constexpr int kStatements = 20000;
constexpr int kCalls = 64;  ///< nested

struct Killed {};
struct Halted {};

[[noreturn]] void fail(const Node& node, const std::string& what) {
  throw ScriptError("line " + std::to_string(node.line) + ": " + what);
}

Value combine(const Node& node, const std::string& op, const Value& a, const Value& b) {
  if (op == "==") return static_cast<const std::variant<std::monostate, bool, double, std::string, List>&>(a) == b;
  if (op == "!=") return !std::get<bool>(combine(node, "==", a, b));
  const auto* left = std::get_if<List>(&a);
  const auto* right = std::get_if<List>(&b);
  if (left != nullptr || right != nullptr) {  // entry by entry, and a number with each entry
    if (left != nullptr && right != nullptr && left->size() != right->size()) fail(node, "lists of different lengths");
    List result;
    const std::size_t size = left != nullptr ? left->size() : right->size();
    for (std::size_t i = 0; i < size; ++i) {
      result.push_back(combine(node, op, left != nullptr ? (*left)[i] : a, right != nullptr ? (*right)[i] : b));
    }
    return result;
  }
  const double x = number(a), y = number(b);
  switch (op[0]) {
    case '+':
      return x + y;
    case '-':
      return x - y;
    case '*':
      return x * y;
    case '/':
      if (y == 0.0) fail(node, "division by zero");
      return x / y;
    case '%':
      return std::fmod(x, y);
    case '<':
      return op.size() > 1 ? x <= y : x < y;
    default:
      return op.size() > 1 ? x >= y : x > y;
  }
}

}  // namespace

double number(const Value& value) {
  if (const auto* x = std::get_if<double>(&value)) return *x;
  if (const auto* x = std::get_if<bool>(&value)) return *x ? 1.0 : 0.0;
  throw ScriptError("a number is expected");
}

bool truth(const Value& value) {
  if (const auto* x = std::get_if<bool>(&value)) return *x;
  throw ScriptError("True or False is expected");
}

const List& list(const Value& value) {
  if (const auto* x = std::get_if<List>(&value)) return *x;
  throw ScriptError("a list is expected");
}

std::string text(const Value& value) {
  if (const auto* x = std::get_if<std::string>(&value)) return *x;
  if (const auto* x = std::get_if<bool>(&value)) return *x ? "True" : "False";
  if (const auto* x = std::get_if<double>(&value)) return std::to_string(*x);
  if (const auto* x = std::get_if<List>(&value)) {
    std::string all = "[";
    for (const Value& each : *x) all += text(each) + ", ";
    return all + "]";
  }
  return "None";
}

Value Arguments::get(std::size_t i, const std::string& name, const Value& otherwise) const {
  if (const auto found = named.find(name); found != named.end()) return found->second;
  return i < values.size() ? values[i] : otherwise;
}

/// A thread of the program: it has its own stack, and is left in the middle of a call when it waits.
class Program::Fiber final : public Waiting {
 public:
  explicit Fiber(std::function<void(Fiber&)> work) : work_(std::move(work)), stack_(new char[kStack]) {
    getcontext(&own_);
    own_.uc_stack.ss_sp = stack_.get();
    own_.uc_stack.ss_size = kStack;
    own_.uc_link = nullptr;
    const auto self = reinterpret_cast<std::uintptr_t>(this);
    makecontext(&own_, reinterpret_cast<void (*)()>(&Fiber::enter), 2, static_cast<unsigned>(self >> 32),
                static_cast<unsigned>(self));
  }
  ~Fiber() override { kill(); }
  Fiber(const Fiber&) = delete;
  Fiber& operator=(const Fiber&) = delete;

  /// Runs until it waits or ends.
  void go() {
    if (ended) return;
    effort = 0;
    void* mine = nullptr;
    leaving(&mine, stack_.get(), kStack);
    swapcontext(&caller_, &own_);
    arrived(mine, nullptr, nullptr);
  }
  void kill() {
    killed = true;
    go();
  }
  void next_cycle() override {
    statements = 0;
    wait();
  }
  /// Without being asked to.
  void wait() {
    void* mine = nullptr;
    leaving(&mine, callers_stack_, callers_size_);
    swapcontext(&own_, &caller_);
    arrived(mine, &callers_stack_, &callers_size_);
    if (killed) throw Killed{};
  }

  bool killed = false, ended = false;
  int statements = 0, calls = 0;
  int effort = 0;  ///< in this cycle

 private:
  static void enter(unsigned high, unsigned low) {
    auto* fiber = reinterpret_cast<Fiber*>((static_cast<std::uintptr_t>(high) << 32) | low);
    arrived(nullptr, &fiber->callers_stack_, &fiber->callers_size_);
    fiber->work();
    leaving(nullptr, fiber->callers_stack_, fiber->callers_size_);
    setcontext(&fiber->caller_);
  }
  void work() {
    try {
      if (!killed) work_(*this);
    } catch (const Killed&) {
    } catch (const Halted&) {
    }
    ended = true;
  }
  // AddressSanitizer wants to know which stack is in use.
#ifdef __SANITIZE_ADDRESS__
  static void leaving(void** mine, const void* other, std::size_t size) {
    __sanitizer_start_switch_fiber(mine, other, size);
  }
  static void arrived(void* mine, const void** other, std::size_t* size) {
    __sanitizer_finish_switch_fiber(mine, other, size);
  }
#else
  static void leaving(void**, const void*, std::size_t) {}
  static void arrived(void*, const void**, std::size_t*) {}
#endif

  static constexpr std::size_t kStack = 4 << 20;  ///< of which the system gives what is touched
  std::function<void(Fiber&)> work_;
  std::unique_ptr<char[]> stack_;
  ucontext_t own_{}, caller_{};
  const void* callers_stack_ = nullptr;
  std::size_t callers_size_ = 0;
};

Program::Program(const std::string& source, const Builtins& builtins, int budget)
    : builtins_(&builtins), root_(parse(source)), budget_(budget) {
  for (const auto& part : root_->parts) {
    if (part->kind != Kind::kFunction) fail(*part, "only functions stand outside of functions");
    functions_[part->text] = part.get();
    name_ = part->text;
  }
  if (name_.empty()) throw ScriptError("there is no function to run");
  start(name_, {});
}

Program::~Program() = default;

void Program::start(const std::string& function, List arguments) {
  const Node& definition = *functions_.at(function);
  const bool main = fibers_.empty();
  fibers_.push_back(std::make_unique<Fiber>([this, main, &definition, arguments = std::move(arguments)](Fiber& fiber) {
    try {
      (void)call(fiber, definition, arguments);
      if (main) halted_ = true;
    } catch (const ScriptError& error) {
      error_ = error.what();
      halted_ = true;
    }
  }));
}

bool Program::cycle() {
  for (std::size_t i = 0; i < fibers_.size() && !halted_; ++i) {
    if (critical_ == nullptr || critical_ == fibers_[i].get()) fibers_[i]->go();
  }
  effort_ = fibers_[0]->effort;
  return !halted_;
}

Value Program::call(Fiber& fiber, const Node& definition, const List& arguments) {
  if (arguments.size() > definition.names.size()) fail(definition, "too many arguments for " + definition.text);
  if (++fiber.calls > kCalls) fail(definition, "too many calls inside calls");
  Scope scope;
  for (std::size_t i = 0; i < arguments.size(); ++i) scope[definition.names[i]] = arguments[i];
  Value result;
  (void)run(fiber, definition.parts, scope, result);
  --fiber.calls;
  return result;
}

Program::Flow Program::run(Fiber& fiber, const std::vector<std::unique_ptr<Node>>& block, Scope& scope, Value& result) {
  for (const auto& statement : block) {
    if (const Flow flow = run(fiber, *statement, scope, result); flow != Flow::kNext) return flow;
  }
  return Flow::kNext;
}

/// A frame is lost to a thread that has used up its share of the cycle.
void Program::spend(Fiber& fiber) {
  largest_effort_ = std::max(largest_effort_, ++fiber.effort);
  if (budget_ == 0 || fiber.effort <= budget_) return;
  ++overruns_;
  fiber.wait();
}

Program::Flow Program::run(Fiber& fiber, const Node& node, Scope& scope, Value& result) {
  spend(fiber);
  if (++fiber.statements > kStatements) fail(node, "a loop that takes a whole control cycle: sync() is missing");
  switch (node.kind) {
    case Kind::kBlock:
      return run(fiber, node.parts, scope, result);
    case Kind::kFunction:
      functions_[node.text] = &node;
      return Flow::kNext;
    case Kind::kIf:
      for (std::size_t i = 0; i < node.blocks.size(); i += 2) {
        if (i + 1 == node.blocks.size()) return run(fiber, *node.blocks[i], scope, result);
        if (truth(evaluate(fiber, *node.blocks[i], scope))) return run(fiber, *node.blocks[i + 1], scope, result);
      }
      return Flow::kNext;
    case Kind::kWhile:
      while (truth(evaluate(fiber, *node.blocks[0], scope))) {
        if (++fiber.statements > kStatements) fail(node, "a loop that takes a whole control cycle: sync() is missing");
        const Flow flow = run(fiber, node.parts, scope, result);
        if (flow == Flow::kReturn) return flow;
        if (flow == Flow::kBreak) break;
      }
      return Flow::kNext;
    case Kind::kAssign: {
      Value value = evaluate(fiber, *node.parts[1], scope);
      const Node& place = *node.parts[0];
      if (place.kind == Kind::kIndex) {
        auto* entries = std::get_if<List>(&variable(*place.parts[0], scope, false));
        const double index = number(evaluate(fiber, *place.parts[1], scope));
        if (entries == nullptr || !(index >= 0.0) || index >= static_cast<double>(entries->size())) {
          fail(node, "no such entry");
        }
        (*entries)[static_cast<std::size_t>(index)] = std::move(value);
      } else if (node.text == "global") {
        globals_[place.text] = std::move(value);
      } else if (node.text == "local") {
        scope[place.text] = std::move(value);
      } else {
        variable(place, scope, true) = std::move(value);
      }
      return Flow::kNext;
    }
    case Kind::kReturn:
      if (!node.parts.empty()) result = evaluate(fiber, *node.parts[0], scope);
      return Flow::kReturn;
    case Kind::kBreak:
      return Flow::kBreak;
    case Kind::kContinue:
      return Flow::kContinue;
    case Kind::kHalt:
      halted_ = true;
      throw Halted{};
    case Kind::kEnter:
      critical_ = &fiber;
      return Flow::kNext;
    case Kind::kExit:
      critical_ = nullptr;
      return Flow::kNext;
    case Kind::kKill:
    case Kind::kJoin: {
      const double index = number(evaluate(fiber, *node.parts[0], scope));
      if (!(index >= 1.0) || index >= static_cast<double>(fibers_.size())) return Flow::kNext;
      Fiber& other = *fibers_[static_cast<std::size_t>(index)];
      if (node.kind == Kind::kKill && &other != &fiber) other.kill();
      while (node.kind == Kind::kJoin && !other.ended) fiber.next_cycle();
      return Flow::kNext;
    }
    default:
      (void)evaluate(fiber, *node.parts[0], scope);
      return Flow::kNext;
  }
}

/// The function's variable if it has one of that name, else the program's.
Value& Program::variable(const Node& node, Scope& scope, bool create) {
  if (const auto found = scope.find(node.text); found != scope.end()) return found->second;
  if (const auto found = globals_.find(node.text); found != globals_.end()) return found->second;
  if (!create) fail(node, "there is no variable '" + node.text + "'");
  return scope[node.text];
}

Value Program::evaluate(Fiber& fiber, const Node& node, Scope& scope) {
  spend(fiber);
  switch (node.kind) {
    case Kind::kNumber:
      return node.number;
    case Kind::kText:
      return node.text;
    case Kind::kTrue:
      return true;
    case Kind::kFalse:
      return false;
    case Kind::kName:
      return variable(node, scope, false);
    case Kind::kList: {
      List entries;
      for (const auto& part : node.parts) entries.push_back(evaluate(fiber, *part, scope));
      return entries;
    }
    case Kind::kIndex: {
      const Value entries = evaluate(fiber, *node.parts[0], scope);
      const double index = number(evaluate(fiber, *node.parts[1], scope));
      if (!(index >= 0.0) || index >= static_cast<double>(list(entries).size())) fail(node, "no such entry");
      return list(entries)[static_cast<std::size_t>(index)];
    }
    case Kind::kUnary: {
      const Value value = evaluate(fiber, *node.parts[0], scope);
      if (node.text == "not") return !truth(value);
      return combine(node, "*", node.text == "-" ? -1.0 : 1.0, value);
    }
    case Kind::kBinary: {
      const Value left = evaluate(fiber, *node.parts[0], scope);
      if (node.text == "and") return truth(left) && truth(evaluate(fiber, *node.parts[1], scope));
      if (node.text == "or") return truth(left) || truth(evaluate(fiber, *node.parts[1], scope));
      const Value right = evaluate(fiber, *node.parts[1], scope);
      if (node.text == "xor") return truth(left) != truth(right);
      return combine(node, node.text, left, right);
    }
    default:
      return evaluate_call(fiber, node, scope);
  }
}

Value Program::evaluate_call(Fiber& fiber, const Node& node, Scope& scope) {
  Arguments arguments;
  for (std::size_t i = 0; i < node.parts.size(); ++i) {
    Value value = evaluate(fiber, *node.parts[i], scope);
    if (node.names[i].empty()) {
      arguments.values.push_back(std::move(value));
    } else {
      arguments.named[node.names[i]] = std::move(value);
    }
  }
  const auto function = functions_.find(node.text);
  if (node.kind == Kind::kRun) {
    if (function == functions_.end()) fail(node, "there is no thread '" + node.text + "'");
    if (fibers_.size() >= 64) fail(node, "too many threads");
    start(node.text, arguments.values);
    return static_cast<double>(fibers_.size() - 1);
  }
  if (function != functions_.end()) return call(fiber, *function->second, arguments.values);
  const auto builtin = builtins_->find(node.text);
  if (builtin == builtins_->end()) fail(node, "'" + node.text + "' is not there");
  return builtin->second(arguments, fiber);
}

}  // namespace steadyhand::urscript
