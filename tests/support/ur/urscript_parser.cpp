#include "support/ur/urscript_parser.hpp"

#include <cctype>
#include <cstdlib>
#include <set>

#include "support/ur/urscript.hpp"

namespace steadyhand::urscript {

namespace {

struct Token {
  enum Type { kEnd, kNewline, kNumber, kText, kName, kSymbol } type;
  std::string text;
  int line;
};

std::vector<Token> scan(const std::string& source) {
  std::vector<Token> tokens;
  int line = 1;
  for (std::size_t i = 0; i < source.size();) {
    const char c = source[i];
    const auto character = [&](std::size_t at) { return at < source.size() ? source[at] : '\0'; };
    const auto is = [&](int (*kind)(int), std::size_t at) {
      return kind(static_cast<unsigned char>(character(at))) != 0;
    };
    std::size_t end = i + 1;
    if (c == '\n') {
      tokens.push_back({Token::kNewline, "", line++});
    } else if (c == '#') {
      while (end < source.size() && source[end] != '\n') ++end;
    } else if (c == '"') {
      while (end < source.size() && source[end] != '"' && source[end] != '\n') ++end;
      if (character(end) != '"') throw ScriptError("line " + std::to_string(line) + ": text without end");
      tokens.push_back({Token::kText, source.substr(i + 1, end - i - 1), line});
      ++end;
    } else if (is(std::isdigit, i) || (c == '.' && is(std::isdigit, i + 1))) {
      char* after = nullptr;
      (void)std::strtod(source.c_str() + i, &after);
      end = static_cast<std::size_t>(after - source.c_str());
      tokens.push_back({Token::kNumber, source.substr(i, end - i), line});
    } else if (is(std::isalpha, i) || c == '_') {
      while (is(std::isalnum, end) || character(end) == '_') ++end;
      tokens.push_back({Token::kName, source.substr(i, end - i), line});
    } else if (!is(std::isspace, i)) {
      const std::string two = source.substr(i, 2);
      if (two == "==" || two == "!=" || two == "<=" || two == ">=") ++end;
      tokens.push_back({Token::kSymbol, source.substr(i, end - i), line});
    }
    i = end;
  }
  tokens.push_back({Token::kEnd, "", line});
  return tokens;
}

class Parser {
 public:
  explicit Parser(const std::string& source) : tokens_(scan(source)) {}

  std::unique_ptr<Node> program() {
    auto root = make(Kind::kBlock);
    root->parts = block();
    if (peek().type != Token::kEnd) fail("unexpected '" + peek().text + "'");
    return root;
  }

 private:
  using NodePointer = std::unique_ptr<Node>;

  const Token& peek(std::size_t ahead = 0) const { return tokens_[std::min(at_ + ahead, tokens_.size() - 1)]; }
  bool is(const char* text) const {
    return (peek().type == Token::kName || peek().type == Token::kSymbol) && peek().text == text;
  }
  bool accept(const char* text) {
    if (!is(text)) return false;
    ++at_;
    return true;
  }
  void expect(const char* text) {
    if (!accept(text)) fail(std::string("'") + text + "' expected, not '" + peek().text + "'");
  }
  std::string name() {
    if (peek().type != Token::kName) fail("a name is expected, not '" + peek().text + "'");
    return tokens_[at_++].text;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw ScriptError("line " + std::to_string(peek().line) + ": " + what);
  }
  NodePointer make(Kind kind, std::string text = "") const {
    auto node = std::make_unique<Node>();
    node->kind = kind;
    node->line = peek().line;
    node->text = std::move(text);
    return node;
  }
  void skip_newlines() {
    while (peek().type == Token::kNewline) ++at_;
  }

  /// Up to the keyword that ends a block, which is not consumed.
  std::vector<NodePointer> block() {
    if (++depth_ > 100) fail("nested too deeply");
    std::vector<NodePointer> statements;
    for (skip_newlines(); peek().type != Token::kEnd && !is("end") && !is("elif") && !is("else"); skip_newlines()) {
      statements.push_back(statement());
    }
    --depth_;
    return statements;
  }

  NodePointer statement() {
    for (const auto& [word, kind] : {std::pair("break", Kind::kBreak), std::pair("continue", Kind::kContinue),
                                     std::pair("halt", Kind::kHalt), std::pair("enter_critical", Kind::kEnter),
                                     std::pair("exit_critical", Kind::kExit), std::pair("pass", Kind::kBlock)}) {
      if (accept(word)) return make(kind);
    }
    if (is("def") || is("thread") || is("sec")) return function();
    if (is("if")) return condition();
    if (is("while")) {
      auto node = make(Kind::kWhile);
      ++at_;
      node->blocks.push_back(expression());
      expect(":");
      node->parts = block();
      expect("end");
      return node;
    }
    if (is("return")) {
      auto node = make(Kind::kReturn);
      ++at_;
      if (peek().type != Token::kNewline && !is("end")) node->parts.push_back(expression());
      return node;
    }
    for (const auto& [word, kind] : {std::pair("kill", Kind::kKill), std::pair("join", Kind::kJoin)}) {
      if (!accept(word)) continue;
      auto node = make(kind);
      node->parts.push_back(expression());
      return node;
    }
    std::string scope;
    if (is("global") || is("local")) scope = tokens_[at_++].text;
    auto left = expression();
    if (!accept("=")) {
      auto node = make(Kind::kExpression);
      node->parts.push_back(std::move(left));
      return node;
    }
    const bool place = left->kind == Kind::kName || (left->kind == Kind::kIndex && left->parts[0]->kind == Kind::kName);
    if (!place) fail("nothing that can be assigned to");
    auto node = make(Kind::kAssign, scope);
    node->parts.push_back(std::move(left));
    skip_newlines();  // the value may be on the next line
    node->parts.push_back(expression());
    return node;
  }

  NodePointer function() {
    ++at_;
    auto node = make(Kind::kFunction);
    node->text = name();
    expect("(");
    while (!accept(")")) {
      node->names.push_back(name());
      if (!is(")")) expect(",");
    }
    expect(":");
    node->parts = block();
    expect("end");
    return node;
  }

  NodePointer condition() {
    auto node = make(Kind::kIf);
    do {
      ++at_;  // if, elif
      node->blocks.push_back(expression());
      expect(":");
      node->blocks.push_back(make(Kind::kBlock));
      node->blocks.back()->parts = block();
    } while (is("elif"));
    if (accept("else")) {
      expect(":");
      node->blocks.push_back(make(Kind::kBlock));
      node->blocks.back()->parts = block();
    }
    expect("end");
    return node;
  }

  NodePointer binary(int level) {
    static const std::vector<std::set<std::string>> kLevels = {
        {"or", "xor"}, {"and"}, {"==", "!=", "<", ">", "<=", ">="}, {"+", "-"}, {"*", "/", "%"}};
    if (level == static_cast<int>(kLevels.size())) return unary();
    auto left = binary(level + 1);
    while ((peek().type == Token::kSymbol || peek().type == Token::kName) && kLevels[level].count(peek().text) > 0) {
      auto node = make(Kind::kBinary, peek().text);
      ++at_;
      node->parts.push_back(std::move(left));
      node->parts.push_back(binary(level + 1));
      left = std::move(node);
    }
    return left;
  }
  NodePointer expression() {
    if (++depth_ > 100) fail("nested too deeply");
    auto node = binary(0);
    --depth_;
    return node;
  }

  NodePointer unary() {
    if (is("-") || is("not") || is("+")) {
      if (++depth_ > 100) fail("nested too deeply");
      auto node = make(Kind::kUnary, peek().text);
      ++at_;
      node->parts.push_back(unary());
      --depth_;
      return node;
    }
    auto node = atom();
    while (is("[")) {
      ++at_;
      auto index = make(Kind::kIndex);
      index->parts.push_back(std::move(node));
      index->parts.push_back(expression());
      expect("]");
      node = std::move(index);
    }
    return node;
  }

  NodePointer list() {
    auto node = make(Kind::kList);
    expect("[");
    while (!accept("]")) {
      node->parts.push_back(expression());
      if (!is("]")) expect(",");
    }
    return node;
  }

  /// p[x, y, z, rx, ry, rz] is a pose, p[i] an entry of the variable p.
  bool is_pose() const {
    if (!is("p") || peek(1).text != "[") return false;
    int depth = 0;
    for (std::size_t i = 1; peek(i).type != Token::kNewline && peek(i).type != Token::kEnd; ++i) {
      const std::string& t = peek(i).text;
      if (t == "[" || t == "(") ++depth;
      if ((t == "]" || t == ")") && --depth == 0) return false;
      if (t == "," && depth == 1) return true;
    }
    return false;
  }

  NodePointer atom() {
    if (peek().type == Token::kNumber) {
      auto node = make(Kind::kNumber);
      node->number = std::strtod(tokens_[at_++].text.c_str(), nullptr);
      return node;
    }
    if (peek().type == Token::kText) return make(Kind::kText, tokens_[at_++].text);
    if (accept("(")) {
      auto node = expression();
      expect(")");
      return node;
    }
    if (is("[")) return list();
    if (is_pose()) {
      ++at_;
      return list();
    }
    if (accept("True") || accept("TRUE")) return make(Kind::kTrue);
    if (accept("False") || accept("FALSE")) return make(Kind::kFalse);
    const bool thread = accept("run");
    auto node = make(Kind::kName);
    node->text = name();
    if (!is("(")) return node;
    ++at_;
    node->kind = thread ? Kind::kRun : Kind::kCall;
    while (!accept(")")) {
      std::string argument;
      if (peek().type == Token::kName && peek(1).text == "=") {
        argument = name();
        ++at_;
      }
      node->names.push_back(argument);
      node->parts.push_back(expression());
      if (!is(")")) expect(",");
    }
    return node;
  }

  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

std::unique_ptr<Node> parse(const std::string& source) { return Parser(source).program(); }

}  // namespace steadyhand::urscript
