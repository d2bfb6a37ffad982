#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/config/yaml_reader.hpp"

namespace steadyhand {

/// Names for values in settings structs. A file and the command line can set them, and people can read each value's
/// meaning, unit and source. A key is NAME or SECTION.NAME. One thread.
class SettingsTable {
 public:
  /// A number, also a whole one. The variable must outlive the table; its value now is the default.
  /// @param word another name of 0; empty: none
  template <typename Number>
  void add(const std::string& key, const std::string& unit, const std::string& what, Number& value,
           const Interval& interval, const std::string& word = "") {
    Entry entry{key, unit, what, interval, word, std::is_integral_v<Number>, {}, "default", {}, {}, {}};
    entry.number = [&value] { return static_cast<double>(value); };
    entry.set_number = [&value](double number) { value = static_cast<Number>(number); };
    entries_.push_back(std::move(entry));
  }
  void add(const std::string& key, const std::string& what, bool& value);
  /// @param choices empty: any text
  void add(const std::string& key, const std::string& what, std::string& value, std::vector<std::string> choices = {});

  /// Takes the file's values. Refuses with file and line: keys that do not exist (with the nearest that does), wrong
  /// types, numbers that are not finite or outside their interval, texts that are no choice. Then some may be set.
  Status load(const std::filesystem::path& file);
  /// @param origin where the value comes from, for people, e.g. "--rate"; begins the message if it is refused
  Status set(const std::string& key, const std::string& value, const std::string& origin);
  /// "KEY=VALUE", from the command line.
  Status set(const std::string& assignment);

  /// YAML that load() reads: every key with its value, and in a comment its unit, what it is, and its origin.
  std::string format() const;
  /// Where a key's value comes from: "default", "FILE:LINE" or the option.
  std::string origin(const std::string& key) const;
  /// Every key with its value.
  std::map<std::string, std::string> values() const;

 private:
  struct Entry {
    std::string key, unit, what;
    Interval interval;
    std::string word;
    bool whole = false;
    std::vector<std::string> choices;
    std::string origin;
    std::function<double()> number;          ///< of numbers
    std::function<void(double)> set_number;  ///< of numbers
    std::function<std::string*()> text;      ///< of texts
    std::function<bool*()> flag = {};        ///< of flags
  };
  static Status assign(Entry& entry, const std::string& value);
  static std::string value_of(const Entry& entry);
  Entry* find(const std::string& key);

  std::vector<Entry> entries_;
};

}  // namespace steadyhand
