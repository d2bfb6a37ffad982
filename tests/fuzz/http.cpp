// The head of a request.
#include "serve/http.hpp"

#include "fuzz/fuzz.hpp"
#include "serve/access.hpp"

namespace steadyhand {

FUZZ(http) {
  const Result<HttpRequest> request = parse_request(input);
  if (!request) return fuzz::require(!request.error().message.empty(), "a refusal says why");
  fuzz::require(!request->method.empty() && !request->target.empty(), "a request for something");
  for (const auto& [name, value] : request->fields) {
    fuzz::require(name.find_first_of("\r\n: ABCXYZ") == std::string::npos, "a field's name");
    fuzz::require(value.find_first_of("\r\n") == std::string::npos, "a field's value");
  }
  (void)request->wants_websocket();
  (void)host_allowed(request->host(), {"localhost", "[::1]", "127.0.0.1"});
  if (const std::string* origin = request->find("origin")) (void)origin_allowed(*origin, request->host(), false);
}

}  // namespace steadyhand
