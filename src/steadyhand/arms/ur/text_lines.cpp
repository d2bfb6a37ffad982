#include "steadyhand/arms/ur/text_lines.hpp"

#include <array>
#include <chrono>

namespace steadyhand {

namespace {
constexpr std::size_t kLongestLine = 1 << 16;
}

Result<std::string> TextLines::ask(const std::string& question) {
  if (question.find('\n') != std::string::npos) return Error{"a question to " + whose_ + " is one line"};
  if (!socket_.send_all(question + "\n", timeout_)) return Error{whose_ + " closed the connection"};
  return line();
}

Result<std::string> TextLines::line() {
  const auto until = std::chrono::steady_clock::now() + timeout_;
  for (;;) {
    if (const std::size_t end = received_.find('\n'); end != std::string::npos) {
      std::string line = received_.substr(0, end);
      received_.erase(0, end + 1);
      if (!line.empty() && line.back() == '\r') line.pop_back();
      return line;
    }
    std::array<std::uint8_t, 1024> bytes;
    std::size_t n = 0;
    const Socket::Outcome outcome = socket_.receive(bytes, n);
    received_.append(reinterpret_cast<const char*>(bytes.data()), n);
    if (outcome == Socket::Outcome::kClosed) return Error{whose_ + " closed the connection"};
    if (received_.size() > kLongestLine) return Error{"the answer of " + whose_ + " has no end"};
    const Time left = until - std::chrono::steady_clock::now();
    if (left <= Time(0)) {
      socket_ = Socket();  // an answer that comes late would be taken for that to the next question
      return Error{whose_ + " does not answer"};
    }
    if (outcome == Socket::Outcome::kNothing) (void)socket_.wait_readable(left);
  }
}

}  // namespace steadyhand
