#include "steadyhand/files/config/yaml_reader.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>

#include "steadyhand/core/nearest.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

/// What all mappings of one file share.
struct YamlMap::File {
  /// What has been asked of one mapping, for the check at the end.
  struct Record {
    YAML::Node node;
    std::string path;
    std::vector<std::string> known;
    std::vector<std::string> missing;
  };

  std::string name;
  std::vector<Record> records;
  std::optional<Error> first_error;

  std::string at(const YAML::Node& node) const {
    const YAML::Mark mark = node.Mark();
    return mark.line < 0 ? name : fmt::format("{}:{}", name, mark.line + 1);
  }
};

Result<double> parse_number(const std::string& text) {
  const char *begin = text.data(), *end = begin + text.size();
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
  double value = 0.0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (stop != end || begin == end || error == std::errc::invalid_argument) {
    return Error{fmt::format("is '{}'; a number is expected", text)};
  }
  if (error != std::errc() || !std::isfinite(value)) {
    return Error{fmt::format("is '{}'; it must be a finite number", text)};
  }
  return value;
}

std::string describe(const Interval& interval) {
  if (interval.high == std::numeric_limits<double>::max()) {
    if (interval.low == 0.0) return interval.low_open ? "positive" : "not negative";
    return fmt::format("{} {}", interval.low_open ? "more than" : "at least", interval.low);
  }
  return fmt::format("{} {} and at most {}", interval.low_open ? "more than" : "at least", interval.low, interval.high);
}

namespace {

const char* kind(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Map:
      return "a mapping";
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Scalar:
      return "a single value";
    default:
      return "empty";
  }
}

/// Refuses keys that are no plain words and keys that are there twice.
Status check_keys(const YAML::Node& map, const std::string& file) {
  std::vector<std::string> seen;
  for (const auto& entry : map) {
    const std::string place = fmt::format("{}:{}", file, entry.first.Mark().line + 1);
    if (!entry.first.IsScalar()) return Error{fmt::format("{}: a key must be a word", place)};
    const std::string& key = entry.first.Scalar();
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) {
      return Error{fmt::format("{}: key '{}' is there twice", place, key)};
    }
    seen.push_back(key);
  }
  return Done{};
}

}  // namespace

YamlMap::YamlMap(const YamlMap&) = default;
YamlMap::~YamlMap() = default;
YamlMap::YamlMap(std::shared_ptr<File> file, YAML::Node node, std::string path)
    : file_(std::move(file)), node_(std::move(node)), path_(std::move(path)), record_(file_->records.size()) {
  file_->records.push_back({node_, path_, {}, {}});
  if (!node_.IsMap()) return;
  if (const Status status = check_keys(node_, file_->name); !status && !file_->first_error) {
    file_->first_error = status.error();
  }
}

namespace {

/// Hears a document and keeps nothing.
struct Deaf : YAML::EventHandler {
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// Not by YAML::LoadAll: where a document begins with a comma, it makes empty ones until the memory is full.
bool has_several_documents(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Deaf deaf;
  return parser.HandleNextDocument(deaf) && parser.HandleNextDocument(deaf);
}

}  // namespace

Result<YamlMap> YamlMap::open(const fs::path& path) {
  const std::string name = path.string();
  std::error_code error;
  if (!fs::exists(path, error)) return Error{fmt::format("{}: no such file", name)};
  if (!fs::is_regular_file(path, error)) return Error{fmt::format("{} is not a file", name)};
  std::ifstream stream(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return Error{fmt::format("{} cannot be read", name)};
  YAML::Node document;
  bool several = false;
  try {
    several = has_several_documents(text);
    if (!several) document.reset(YAML::Load(text));
  } catch (const YAML::Exception& exception) {
    return Error{fmt::format("{}:{}: not valid YAML: {}", name, exception.mark.line + 1, exception.msg)};
  } catch (const std::exception& exception) {
    return Error{fmt::format("{}: not valid YAML: {}", name, exception.what())};
  }
  if (several) {
    return Error{fmt::format("{} must contain exactly one YAML document", name)};
  }
  if (document.IsNull()) return Error{fmt::format("{} is empty", name)};
  if (!document.IsMap()) {
    return Error{fmt::format("{} is {}; a mapping (key: value) is expected", name, kind(document))};
  }
  auto file = std::make_shared<File>();
  file->name = name;
  return YamlMap(file, document, "");
}

YAML::Node YamlMap::find(const std::string& key, bool required) {
  File::Record& record = file_->records[record_];
  if (std::find(record.known.begin(), record.known.end(), key) == record.known.end()) record.known.push_back(key);
  if (node_.IsMap()) {
    for (const auto& entry : node_) {
      if (!entry.first.IsScalar() || entry.first.Scalar() != key) continue;
      if (!entry.second.IsNull()) return entry.second;
      // An empty value's own mark is where the next token stands.
      fail_at(entry.first, full_name(key), "is empty; give it a value or remove it");
      return YAML::Node(YAML::NodeType::Undefined);
    }
  }
  if (required) record.missing.push_back(key);
  return YAML::Node(YAML::NodeType::Undefined);
}

void YamlMap::fail_at(const YAML::Node& node, const std::string& what, const std::string& reason) {
  if (!file_->first_error) file_->first_error = Error{fmt::format("{}: {} {}", file_->at(node), what, reason)};
}

bool YamlMap::has(const std::string& key) { return find(key, false).IsDefined(); }
bool YamlMap::is_map(const std::string& key) { return find(key, false).Type() == YAML::NodeType::Map; }
bool YamlMap::is_list(const std::string& key) { return find(key, false).Type() == YAML::NodeType::Sequence; }

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> result;
  if (!node_.IsMap()) return result;
  for (const auto& entry : node_) {
    if (entry.first.IsScalar()) result.push_back(entry.first.Scalar());
  }
  return result;
}

std::string YamlMap::text(const std::string& key, const std::optional<std::string>& fallback) {
  const YAML::Node node = find(key, !fallback);
  if (!node.IsDefined()) return fallback.value_or("");
  const bool may_be_empty = fallback && fallback->empty();
  if (!node.IsScalar() || (node.Scalar().empty() && !may_be_empty)) {
    fail_at(node, full_name(key), fmt::format("is {}; a text is expected", node.IsScalar() ? "empty" : kind(node)));
    return "";
  }
  return node.Scalar();
}

double YamlMap::read_number(const YAML::Node& node, const std::string& what, const Interval& interval) {
  if (!node.IsScalar()) {
    fail_at(node, what, fmt::format("is {}; a number is expected", kind(node)));
    return 0.0;
  }
  const Result<double> value = parse_number(node.Scalar());
  if (!value) {
    fail_at(node, what, value.error().message);
    return 0.0;
  }
  if (!interval.contains(*value)) {
    fail_at(node, what, fmt::format("is {}; it must be {}", node.Scalar(), describe(interval)));
  }
  return *value;
}

double YamlMap::number(const std::string& key, const Interval& interval, std::optional<double> fallback) {
  const YAML::Node node = find(key, !fallback);
  return node.IsDefined() ? read_number(node, full_name(key), interval) : fallback.value_or(0.0);
}

int YamlMap::integer(const std::string& key, int low, int high, std::optional<int> fallback) {
  const YAML::Node node = find(key, !fallback);
  if (!node.IsDefined()) return fallback.value_or(low);
  const double value = read_number(node, full_name(key), {static_cast<double>(low), static_cast<double>(high), false});
  if (value != std::floor(value)) fail_at(node, full_name(key), fmt::format("is {}; it must be a whole number", value));
  return static_cast<int>(std::clamp<double>(value, low, high));
}

bool YamlMap::boolean(const std::string& key, std::optional<bool> fallback) {
  const YAML::Node node = find(key, !fallback);
  if (!node.IsDefined()) return fallback.value_or(false);
  if (node.IsScalar() && (node.Scalar() == "true" || node.Scalar() == "false")) return node.Scalar() == "true";
  fail_at(node, full_name(key),
          fmt::format("is {}; true or false is expected", node.IsScalar() ? "'" + node.Scalar() + "'" : kind(node)));
  return false;
}

std::vector<double> YamlMap::numbers(const std::string& key, const Interval& interval, std::size_t size) {
  const YAML::Node node = find(key, true);
  std::vector<double> values(size, 0.0);
  if (!node.IsDefined()) return values;
  if (!node.IsSequence() || node.size() == 0) {
    fail_at(node, full_name(key),
            fmt::format("is {}; a list of numbers is expected", node.IsSequence() ? "an empty list" : kind(node)));
    return values;
  }
  if (size != 0 && node.size() != size) {
    fail_at(node, full_name(key), fmt::format("has {} numbers; {} are expected", node.size(), size));
    return values;
  }
  values.resize(node.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = read_number(node[i], fmt::format("{}[{}]", full_name(key), i), interval);
  }
  return values;
}

std::vector<double> YamlMap::number_or_numbers(const std::string& key, const Interval& interval) {
  const YAML::Node node = find(key, true);
  if (node.IsDefined() && node.IsScalar()) return {read_number(node, full_name(key), interval)};
  return numbers(key, interval);
}

std::optional<std::vector<double>> YamlMap::optional_numbers(const std::string& key, const Interval& interval) {
  if (!has(key)) return std::nullopt;
  return numbers(key, interval);
}

YamlMap YamlMap::map(const std::string& key) {
  const YAML::Node node = find(key, true);
  if (node.IsDefined() && !node.IsMap()) {
    fail_at(node, full_name(key), fmt::format("is {}; a mapping (key: value) is expected", kind(node)));
  }
  return {file_, node, full_name(key)};
}

std::vector<YamlMap> YamlMap::maps(const std::string& key) {
  const YAML::Node node = find(key, true);
  std::vector<YamlMap> result;
  if (!node.IsDefined()) return result;
  if (!node.IsSequence()) {
    fail_at(node, full_name(key), fmt::format("is {}; a list of mappings is expected", kind(node)));
    return result;
  }
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string name = fmt::format("{}[{}]", full_name(key), i);
    if (!node[i].IsMap()) fail_at(node[i], name, fmt::format("is {}; a mapping is expected", kind(node[i])));
    result.push_back({file_, node[i], name});
  }
  return result;
}

std::vector<std::string> YamlMap::texts(const std::string& key) {
  const YAML::Node node = find(key, true);
  std::vector<std::string> result;
  if (!node.IsDefined()) return result;
  if (!node.IsSequence()) {
    fail_at(node, full_name(key), fmt::format("is {}; a list of texts is expected", kind(node)));
    return result;
  }
  for (std::size_t i = 0; i < node.size(); ++i) {
    if (node[i].IsScalar()) {
      result.push_back(node[i].Scalar());
    } else {
      fail_at(node[i], fmt::format("{}[{}]", full_name(key), i),
              fmt::format("is {}; a text is expected", kind(node[i])));
    }
  }
  return result;
}

std::vector<std::vector<std::string>> YamlMap::text_lists(const std::string& key, std::size_t size) {
  const YAML::Node node = find(key, true);
  std::vector<std::vector<std::string>> result;
  if (!node.IsDefined()) return result;
  if (!node.IsSequence()) {
    fail_at(node, full_name(key), fmt::format("is {}; a list of lists of {} texts is expected", kind(node), size));
    return result;
  }
  for (std::size_t i = 0; i < node.size(); ++i) {
    std::vector<std::string> texts;
    if (node[i].IsSequence()) {  // a mapping's items are pairs, which are no nodes
      for (const YAML::Node& item : node[i]) {
        if (item.IsScalar()) texts.push_back(item.Scalar());
      }
    }
    if (!node[i].IsSequence() || node[i].size() != size || texts.size() != size) {
      fail_at(node[i], fmt::format("{}[{}]", full_name(key), i), fmt::format("must be a list of {} texts", size));
      texts.assign(size, "");
    }
    result.push_back(std::move(texts));
  }
  return result;
}

std::string YamlMap::place(const std::string& key) const {
  std::string place = file_->at(node_);
  if (node_.IsMap()) {
    for (const auto& entry : node_) {
      if (entry.first.IsScalar() && entry.first.Scalar() == key) place = file_->at(entry.first);
    }
  }
  return place;
}

std::string YamlMap::where(const std::string& key) const { return fmt::format("{}: {}", place(key), full_name(key)); }

void YamlMap::fail(const std::string& key, const std::string& reason) {
  if (!file_->first_error) file_->first_error = Error{where(key) + " " + reason};
}

Status YamlMap::finish() {
  for (const File::Record& record : file_->records) {
    if (!record.node.IsDefined() || !record.node.IsMap()) continue;
    for (const auto& entry : record.node) {
      if (!entry.first.IsScalar()) continue;
      const std::string& key = entry.first.Scalar();
      if (std::find(record.known.begin(), record.known.end(), key) != record.known.end()) continue;
      return Error{fmt::format("{}: unknown key '{}'{}; {}", file_->at(entry.first), key,
                               record.path.empty() ? "" : fmt::format(" in '{}'", record.path),
                               suggestion(key, record.known))};
    }
  }
  if (file_->first_error) return *file_->first_error;
  for (const File::Record& record : file_->records) {
    if (record.missing.empty() || !record.node.IsDefined()) continue;
    const std::string key = (record.path.empty() ? "" : record.path + ".") + record.missing[0];
    return Error{fmt::format("{}: key '{}' is missing", file_->at(record.node), key)};
  }
  return Done{};
}

}  // namespace steadyhand
