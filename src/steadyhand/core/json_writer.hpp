#pragma once

#include <charconv>
#include <concepts>
#include <iterator>
#include <string>
#include <string_view>

namespace steadyhand {

using JsonBuffer = std::string;

/// Appends JSON to a buffer, call by call, and adds the commas. Numbers that are not finite become null, since JSON
/// cannot represent them; bytes that are not UTF-8 become U+FFFD.
class JsonWriter {
 public:
  enum class Digits {
    kShortest,  ///< that read back the same
    kSix,       ///< significant ones, for what people look at
  };

  /// The buffer must outlive it.
  explicit JsonWriter(JsonBuffer& out, Digits digits = Digits::kShortest) : out_(&out), digits_(digits) {}

  void begin_object() { open('{'); }
  void end_object() { close('}'); }
  void begin_array() { open('['); }
  void end_array() { close(']'); }
  /// Comes before each value of an object.
  void key(std::string_view name);

  void value(std::floating_point auto number) { number_value(number); }
  /// @param format as fmt's, e.g. "{:.6f}"
  void value(double number, const char* format);
  void value(std::integral auto number) {
    separate();
    char digits[24];
    out_->append(digits, std::to_chars(digits, std::end(digits), number).ptr);
  }
  void value(bool flag) { raw(flag ? "true" : "false"); }
  void value(std::string_view text);
  void value(const char* text) { value(std::string_view(text)); }
  /// A list of numbers, or of what else value() takes.
  template <typename List>
    requires requires(const List& list) { list.size(), list[0]; } && (!std::convertible_to<List, std::string_view>)
  void value(const List& list) {
    begin_array();
    for (int i = 0; i < static_cast<int>(list.size()); ++i) value(list[i]);
    end_array();
  }
  /// JSON as it is.
  void raw(std::string_view json);

  template <typename Value>
  void member(std::string_view name, const Value& what) {
    key(name);
    value(what);
  }

 private:
  void separate() {
    if (comma_) out_->push_back(',');
    comma_ = true;
  }
  void open(char bracket) {
    separate();
    out_->push_back(bracket);
    comma_ = false;
  }
  void close(char bracket) {
    out_->push_back(bracket);
    comma_ = true;
  }
  void number_value(double number);
  void quoted(std::string_view text);

  JsonBuffer* out_;
  Digits digits_;
  bool comma_ = false;  ///< before the next value or key
};

}  // namespace steadyhand
