#include "serve/http.hpp"

#include <algorithm>
#include <cctype>

namespace steadyhand {
namespace {

constexpr std::size_t kMaxFields = 100;

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

bool same(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

/// Characters of methods and of the names of fields.
bool is_name(std::string_view text) {
  const auto good = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string::npos;
  };
  return !text.empty() && std::all_of(text.begin(), text.end(), good);
}

bool is_printable(std::string_view text) {
  return std::none_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; });
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// Up to `end`, which is taken away, too; all of it where there is none.
std::string_view cut(std::string_view& text, std::string_view end) {
  const std::size_t at = text.find(end);
  const std::string_view first = text.substr(0, at);
  text.remove_prefix(at == std::string_view::npos ? text.size() : at + end.size());
  return first;
}

std::string_view reason(HttpStatus status) {
  switch (status) {
    case HttpStatus::kSwitchingProtocols:
      return "Switching Protocols";
    case HttpStatus::kOk:
      return "OK";
    case HttpStatus::kBadRequest:
      return "Bad Request";
    case HttpStatus::kForbidden:
      return "Forbidden";
    case HttpStatus::kNotFound:
      return "Not Found";
    case HttpStatus::kMethodNotAllowed:
      return "Method Not Allowed";
    case HttpStatus::kMisdirected:
      return "Misdirected Request";
    case HttpStatus::kUpgradeRequired:
      return "Upgrade Required";
    case HttpStatus::kUnavailable:
      return "Service Unavailable";
  }
  return "";
}

}  // namespace

const std::string* HttpRequest::find(std::string_view name) const {
  const auto found = std::find_if(fields.begin(), fields.end(), [&](const auto& field) { return field.first == name; });
  return found == fields.end() ? nullptr : &found->second;
}

bool HttpRequest::lists(std::string_view name, std::string_view word) const {
  for (const auto& [key, value] : fields) {
    if (key != name) continue;
    for (std::string_view rest = value; !rest.empty();) {
      if (same(trim(cut(rest, ",")), word)) return true;
    }
  }
  return false;
}

Result<HttpRequest> parse_request(std::string_view head) {
  HttpRequest request;
  std::string_view line = cut(head, "\r\n");
  request.method = cut(line, " ");
  request.target = cut(line, " ");
  if (!is_name(request.method) || request.target.empty() || !is_printable(request.target)) {
    return Error{"not a request of HTTP"};
  }
  const bool newest = line == "HTTP/1.1";
  if (!newest && line != "HTTP/1.0") return Error{"only HTTP/1.1 and 1.0 are answered"};
  for (line = cut(head, "\r\n"); !line.empty(); line = cut(head, "\r\n")) {
    const std::size_t colon = line.find(':');
    const std::string_view name = line.substr(0, colon);
    const std::string_view value = colon == std::string_view::npos ? "" : trim(line.substr(colon + 1));
    if (colon == std::string_view::npos || !is_name(name) || !is_printable(value)) return Error{"a field is malformed"};
    if (request.fields.size() == kMaxFields) return Error{"too many fields"};
    auto& [key, text] = request.fields.emplace_back(name, value);
    std::transform(key.begin(), key.end(), key.begin(), lower);
  }
  const auto hosts = std::count_if(request.fields.begin(), request.fields.end(),
                                   [](const auto& field) { return field.first == "host"; });
  if (hosts > 1) return Error{"more than one Host"};
  const std::string* length = request.find("content-length");
  if (request.find("transfer-encoding") || (length && *length != "0")) return Error{"a request has no body here"};
  request.keep_alive = newest ? !request.lists("connection", "close") : request.lists("connection", "keep-alive");
  return request;
}

std::string answer_head(HttpStatus status, const std::vector<std::pair<std::string_view, std::string>>& fields) {
  std::string head = "HTTP/1.1 " + std::to_string(static_cast<int>(status)) + " ";
  head += reason(status);
  head += "\r\n";
  for (const auto& [name, value] : fields) {
    head += name;
    head += ": ";
    head += value;
    head += "\r\n";
  }
  return head + "\r\n";
}

}  // namespace steadyhand
