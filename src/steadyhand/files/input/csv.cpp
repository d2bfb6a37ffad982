#include "steadyhand/files/input/csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace steadyhand {
namespace {

constexpr std::array<std::string_view, 9> kColumns{"t", "px", "py", "pz", "qx", "qy", "qz", "qw", "clutch"};
constexpr std::size_t kTime = 0;
constexpr std::size_t kClutch = 8;  // the only one that may be left out
constexpr std::string_view kHeader =
    "t,px,py,pz,qx,qy,qz,qw[,clutch], or t and these of each hand, as left_px,right_px";

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// Cuts off and returns what comes before the next separator.
std::string_view next(std::string_view& rest, char separator) {
  const std::size_t length = std::min(rest.find(separator), rest.size());
  const std::string_view piece = rest.substr(0, length);
  rest.remove_prefix(std::min(length + 1, rest.size()));
  return piece;
}

void split(std::string_view line, std::vector<std::string_view>& cells) {
  cells.clear();
  const auto count = std::count(line.begin(), line.end(), ',') + 1;
  for (auto i = count; i > 0; --i) cells.push_back(trim(next(line, ',')));
}

/// A hand of the file, and in which column each of kColumns is.
struct Hand {
  std::string key;  ///< goes with "_" before the names of its columns; empty: the file has one hand without a name
  std::array<std::optional<std::size_t>, kColumns.size()> at{};
};

/// Splits "left_px" into "left" and "px".
std::pair<std::string_view, std::string_view> split_name(std::string_view name) {
  const std::size_t end = name.rfind('_');
  const bool is_named = end != std::string_view::npos && name.substr(end + 1) != kColumns[kTime];
  return is_named ? std::pair(name.substr(0, end), name.substr(end + 1)) : std::pair(std::string_view(), name);
}

Result<std::vector<Hand>> read_header(const std::vector<std::string_view>& names, const std::string& where) {
  std::vector<Hand> hands;
  std::optional<std::size_t> time;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto [key, column] = split_name(names[i]);
    const auto found = std::find(kColumns.begin(), kColumns.end(), column);
    if (found == kColumns.end()) {
      return Error{
          fmt::format("{}: unknown column \"{}\"; the header must be {}", where, names[i].substr(0, 40), kHeader)};
    }
    const auto index = static_cast<std::size_t>(found - kColumns.begin());
    auto hand = std::ranges::find(hands, key, &Hand::key);
    if (index != kTime && hand == hands.end()) hand = hands.insert(hands.end(), {std::string(key)});
    std::optional<std::size_t>& at = index == kTime ? time : hand->at[index];
    if (at) {
      return Error{fmt::format("{}: column \"{}\" appears twice; the header must be {}", where, names[i], kHeader)};
    }
    at = i;
  }
  if (hands.empty()) hands.emplace_back();
  std::vector<std::string> missing;
  for (Hand& hand : hands) {
    hand.at[kTime] = time;
    const bool is_first = &hand == &hands.front();
    for (std::size_t i = is_first ? kTime : kTime + 1; i < kClutch; ++i) {
      const bool is_named = i != kTime && !hand.key.empty();
      if (!hand.at[i]) missing.push_back((is_named ? hand.key + "_" : "") + std::string(kColumns[i]));
    }
  }
  if (!missing.empty()) {
    return Error{fmt::format("{}: missing column{} {}; the header must be {}", where, missing.size() == 1 ? "" : "s",
                             fmt::join(missing, ", "), kHeader)};
  }
  return hands;
}

Result<double> read_number(std::string_view cell, std::string_view column, const std::string& where) {
  std::string_view digits = cell;
  if (cell.size() > 1 && cell[0] == '+' && cell[1] != '-') digits.remove_prefix(1);  // which from_chars refuses
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool number = error == std::errc() && end == digits.data() + digits.size();
  if (number && std::isfinite(value)) return value;
  return Error{fmt::format("{}: column {} is \"{}\"; it must be a finite number", where, column, cell.substr(0, 40))};
}

/// Adds the hand's sample of a line. A hand with a name may have none there: then its cells are empty.
Status read_hand(const Hand& hand, int tool, const std::vector<std::string_view>& names,
                 const std::vector<std::string_view>& cells, const std::string& where, SampleList& samples) {
  const auto is_empty = [&](std::size_t i) { return !hand.at[i] || cells[*hand.at[i]].empty(); };
  bool has_none = !hand.key.empty();
  for (std::size_t i = kTime + 1; i < kColumns.size(); ++i) has_none = has_none && is_empty(i);
  if (has_none) return Done{};
  std::array<double, kColumns.size()> values{};
  values[kClutch] = 1.0;
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    if (!hand.at[i]) continue;
    const Result<double> value = read_number(cells[*hand.at[i]], names[*hand.at[i]], where);
    if (!value) return value.error();
    values[i] = *value;
  }
  const auto& [t, px, py, pz, qx, qy, qz, qw, clutch] = values;
  if (clutch != 0.0 && clutch != 1.0) {
    return Error{fmt::format("{}: column {} is {}; it must be 0 (released) or 1 (engaged)", where,
                             names[*hand.at[kClutch]], clutch)};
  }
  return samples.add({t, {px, py, pz}, {qw, qx, qy, qz}, clutch == 1.0}, where, tool);
}

}  // namespace

Status read_csv(std::string_view text, const std::string& name, const ChooseHands& choose, SampleList& samples) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte order mark of UTF-8, as spreadsheets write it

  std::vector<std::string_view> names, cells;
  std::vector<std::pair<Hand, int>> hands;  // that are chosen, and the tools that they move
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = trim(next(text, '\n'));
    if (line.empty()) continue;
    const std::string where = fmt::format("{}:{}", name, number);
    split(line, cells);
    if (names.empty()) {
      const Result<std::vector<Hand>> all = read_header(cells, where);
      if (!all) return all.error();
      names = cells;
      std::vector<std::string> keys;
      for (const Hand& hand : *all) keys.push_back(hand.key);
      const Result<std::vector<ChosenHand>> chosen = choose(keys);
      if (!chosen) return chosen.error();
      for (const auto& [key, tool] : *chosen) hands.emplace_back(*std::ranges::find(*all, key, &Hand::key), tool);
      continue;
    }
    if (cells.size() != names.size()) {
      return Error{fmt::format("{}: has {} values; the header names {} columns", where, cells.size(), names.size())};
    }
    for (const auto& [hand, tool] : hands) {
      if (const Status read = read_hand(hand, tool, names, cells, where, samples); !read) return read;
    }
  }
  return Done{};
}

}  // namespace steadyhand
