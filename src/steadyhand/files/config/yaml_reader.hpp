#pragma once

#include <yaml-cpp/node/node.h>

#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Numbers that a key may hold; always finite.
struct Interval {
  double low = std::numeric_limits<double>::lowest();
  double high = std::numeric_limits<double>::max();
  bool low_open = false;  ///< low itself is outside

  static Interval any() { return {}; }
  static Interval positive() { return {0.0, std::numeric_limits<double>::max(), true}; }
  static Interval not_negative() { return {0.0}; }
  bool contains(double value) const { return (low_open ? value > low : value >= low) && value <= high; }
};

/// A finite number in decimal notation, in any locale; the error is to follow the value's name.
Result<double> parse_number(const std::string& text);
/// For people: "positive", "at least 4 and at most 500".
std::string describe(const Interval& interval);

/// One mapping of a YAML file, read strictly: a key that is never read, a wrong type, a wrong size, a number that is
/// not finite or outside its interval are errors that name file, line, key, value, and what would be right.
///
/// After an error, reading continues with harmless values, so that a reader is a plain list of assignments; `finish()`
/// reports the first error. Numbers are read with '.' in any locale.
class YamlMap {
 public:
  /// Parses a file that holds one mapping.
  static Result<YamlMap> open(const std::filesystem::path& file);
  YamlMap(const YamlMap&);  // here, like the end, and not inline: node.h only declares what they call
  ~YamlMap();
  YamlMap& operator=(const YamlMap&) = delete;  // assigning a YAML::Node would write into the file's tree

  bool has(const std::string& key);
  bool is_map(const std::string& key);   ///< the key is there and holds a mapping
  bool is_list(const std::string& key);  ///< the key is there and holds a list
  std::vector<std::string> keys() const;

  /// Each reads one key; without a fallback the key must be there.
  std::string text(const std::string& key, const std::optional<std::string>& fallback = {});
  double number(const std::string& key, const Interval& interval, std::optional<double> fallback = {});
  int integer(const std::string& key, int low, int high, std::optional<int> fallback = {});
  bool boolean(const std::string& key, std::optional<bool> fallback = {});
  /// A list of numbers; `size` 0: any but none.
  std::vector<double> numbers(const std::string& key, const Interval& interval, std::size_t size = 0);
  /// A list of numbers, or one number, which makes a list of one.
  std::vector<double> number_or_numbers(const std::string& key, const Interval& interval);
  std::optional<std::vector<double>> optional_numbers(const std::string& key, const Interval& interval);
  /// Mappings inside: read them to their end; their finish() need not be called.
  YamlMap map(const std::string& key);
  std::vector<YamlMap> maps(const std::string& key);
  std::vector<std::string> texts(const std::string& key);
  /// A list of lists of `size` texts.
  std::vector<std::vector<std::string>> text_lists(const std::string& key, std::size_t size);

  /// "FILE:LINE" of a key.
  std::string place(const std::string& key) const;
  /// "FILE:LINE: KEY" of a key, to begin a message with.
  std::string where(const std::string& key) const;
  /// Notes an error of the caller's own about a key.
  void fail(const std::string& key, const std::string& reason);
  /// The first error of this mapping and those read out of it: unknown keys before missing ones.
  Status finish();

 private:
  struct File;
  YamlMap(std::shared_ptr<File> file, YAML::Node node, std::string path);

  YAML::Node find(const std::string& key, bool required);
  void fail_at(const YAML::Node& node, const std::string& what, const std::string& reason);
  double read_number(const YAML::Node& node, const std::string& what, const Interval& interval);
  std::string full_name(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

  std::shared_ptr<File> file_;  ///< shared by all mappings of one file
  YAML::Node node_;
  std::string path_;    ///< of keys from the top, "tool" or "spheres[3]"
  std::size_t record_;  ///< where File keeps what has been asked of this mapping
};

}  // namespace steadyhand
