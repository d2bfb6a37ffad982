#include "steadyhand/files/input/csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

namespace steadyhand {
namespace {

constexpr std::array<std::string_view, 9> kColumns{"t", "px", "py", "pz", "qx", "qy", "qz", "qw", "clutch"};
constexpr std::size_t kClutch = 8;  // the only one that may be left out
constexpr std::string_view kHeader = "t,px,py,pz,qx,qy,qz,qw[,clutch]";

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

/// For each column of the file, its index in kColumns.
Result<std::vector<std::size_t>> read_header(const std::vector<std::string_view>& names, const std::string& where) {
  std::vector<std::size_t> order;
  for (const std::string_view name : names) {
    const auto found = std::find(kColumns.begin(), kColumns.end(), name);
    if (found == kColumns.end()) {
      return Error{fmt::format("{}: unknown column \"{}\"; the header must be {}", where, name.substr(0, 40), kHeader)};
    }
    order.push_back(static_cast<std::size_t>(found - kColumns.begin()));
    if (std::count(order.begin(), order.end(), order.back()) > 1) {
      return Error{fmt::format("{}: column \"{}\" appears twice; the header must be {}", where, name, kHeader)};
    }
  }
  std::vector<std::string_view> missing;
  for (std::size_t i = 0; i < kClutch; ++i) {
    if (std::find(order.begin(), order.end(), i) == order.end()) missing.push_back(kColumns[i]);
  }
  if (!missing.empty()) {
    return Error{fmt::format("{}: missing column{} {}; the header must be {}", where, missing.size() == 1 ? "" : "s",
                             fmt::join(missing, ", "), kHeader)};
  }
  return order;
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

}  // namespace

Status read_csv(std::string_view text, const std::string& name, SampleList& samples) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte order mark of UTF-8, as spreadsheets write it

  std::vector<std::string_view> cells;
  std::optional<std::vector<std::size_t>> order;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = trim(next(text, '\n'));
    if (line.empty()) continue;
    const std::string where = fmt::format("{}:{}", name, number);
    split(line, cells);
    if (!order) {
      Result<std::vector<std::size_t>> header = read_header(cells, where);
      if (!header) return header.error();
      order = *std::move(header);
      continue;
    }
    if (cells.size() != order->size()) {
      return Error{fmt::format("{}: has {} values; the header names {} columns", where, cells.size(), order->size())};
    }
    std::array<double, kColumns.size()> values{};
    values[kClutch] = 1.0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Result<double> value = read_number(cells[i], kColumns[(*order)[i]], where);
      if (!value) return value.error();
      values[(*order)[i]] = *value;
    }
    const auto& [t, px, py, pz, qx, qy, qz, qw, clutch] = values;
    if (clutch != 0.0 && clutch != 1.0) {
      return Error{fmt::format("{}: column clutch is {}; it must be 0 (released) or 1 (engaged)", where, clutch)};
    }
    const Status added = samples.add({t, {px, py, pz}, {qw, qx, qy, qz}, clutch == 1.0}, where);
    if (!added) return added;
  }
  return Done{};
}

}  // namespace steadyhand
