#include "steadyhand/files/config/settings_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/core/nearest.hpp"

namespace steadyhand {

namespace {

std::string section_of(const std::string& key) {
  const std::size_t dot = key.find('.');
  return dot == std::string::npos ? "" : key.substr(0, dot);
}
std::string name_of(const std::string& key) {
  const std::size_t dot = key.find('.');
  return dot == std::string::npos ? key : key.substr(dot + 1);
}

/// A text as YAML that reads back the same.
std::string yaml_text(const std::string& text) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos && text[0] != '-') return text;
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

}  // namespace

void SettingsTable::add(const std::string& key, const std::string& what, bool& value) {
  Entry entry{key, "", what, {}, "", false, {}, "default", {}, {}, {}};
  entry.flag = [&value] { return &value; };
  entries_.push_back(std::move(entry));
}

void SettingsTable::add(const std::string& key, const std::string& what, std::string& value,
                        std::vector<std::string> choices) {
  Entry entry{key, "", what, {}, "", false, std::move(choices), "default", {}, {}, {}};
  entry.text = [&value] { return &value; };
  entries_.push_back(std::move(entry));
}

SettingsTable::Entry* SettingsTable::find(const std::string& key) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.key == key; });
  return found == entries_.end() ? nullptr : &*found;
}

Status SettingsTable::assign(Entry& entry, const std::string& value) {
  if (entry.flag) {
    if (value != "true" && value != "false") return Error{fmt::format("is '{}'; true or false is expected", value)};
    *entry.flag() = value == "true";
    return Done{};
  }
  if (entry.text) {
    const auto& choices = entry.choices;
    if (!choices.empty() && std::find(choices.begin(), choices.end(), value) == choices.end()) {
      return Error{fmt::format("is '{}'; it must be one of {}", value, fmt::join(choices, ", "))};
    }
    *entry.text() = value;
    return Done{};
  }
  if (!entry.word.empty() && value == entry.word) {
    entry.set_number(0.0);
    return Done{};
  }
  const Result<double> number = parse_number(value);
  const std::string word = entry.word.empty() ? "" : fmt::format(", or '{}'", entry.word);
  if (!number) return Error{number.error().message + word};
  if (!entry.interval.contains(*number)) {
    return Error{fmt::format("is {}; it must be {}{}", value, describe(entry.interval), word)};
  }
  if (entry.whole && *number != std::floor(*number)) {
    return Error{fmt::format("is {}; it must be a whole number", value)};
  }
  entry.set_number(*number);
  return Done{};
}

Status SettingsTable::load(const std::filesystem::path& path) {
  Result<YamlMap> opened = YamlMap::open(path);
  if (!opened) return opened.error();
  YamlMap& file = *opened;
  std::map<std::string, YamlMap> sections;
  for (Entry& entry : entries_) {
    const std::string section = section_of(entry.key), name = name_of(entry.key);
    if (!section.empty() && !sections.contains(section)) {
      if (!file.has(section)) continue;
      sections.emplace(section, file.map(section));
    }
    YamlMap& map = section.empty() ? file : sections.at(section);
    if (!map.has(name)) continue;
    const std::string value = map.text(name, "");
    if (value.empty()) continue;  // reported by finish()
    if (const Status s = assign(entry, value); s) {
      entry.origin = map.place(name);
    } else {
      map.fail(name, s.error().message);
    }
  }
  return file.finish();
}

Status SettingsTable::set(const std::string& key, const std::string& value, const std::string& origin) {
  Entry* entry = find(key);
  if (entry == nullptr) {
    std::vector<std::string> known;
    for (const Entry& each : entries_) known.push_back(each.key);
    return Error{fmt::format("{}: unknown key '{}'; {}", origin, key, suggestion(key, known))};
  }
  if (const Status s = assign(*entry, value); !s)
    return Error{fmt::format("{}: {} {}", origin, key, s.error().message)};
  entry->origin = origin;
  return Done{};
}

Status SettingsTable::set(const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos) {
    return Error{fmt::format("--set {}: KEY=VALUE is expected", assignment)};
  }
  return set(assignment.substr(0, equals), assignment.substr(equals + 1), "--set");
}

std::string SettingsTable::value_of(const Entry& entry) {
  if (entry.flag) return *entry.flag() ? "true" : "false";
  if (entry.text) return yaml_text(*entry.text());
  const double value = entry.number();
  return value == 0.0 && !entry.word.empty() ? entry.word : fmt::format("{}", value);
}

std::string SettingsTable::format() const {
  std::string text, section;
  for (const Entry& entry : entries_) {
    const std::string own = section_of(entry.key);
    if (own != section) text += own + ":\n";
    section = own;
    const std::string value = fmt::format("{}{}: {}", own.empty() ? "" : "  ", name_of(entry.key), value_of(entry));
    text += fmt::format("{:<34} # {}{}{} [{}]\n", value, entry.unit, entry.unit.empty() ? "" : ", ", entry.what,
                        entry.origin);
  }
  return text;
}

std::string SettingsTable::origin(const std::string& key) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.key == key; });
  return found == entries_.end() ? "" : found->origin;
}

std::map<std::string, std::string> SettingsTable::values() const {
  std::map<std::string, std::string> result;
  for (const Entry& entry : entries_) result[entry.key] = value_of(entry);
  return result;
}

}  // namespace steadyhand
