#pragma once

#include <string>

#include "steadyhand/arms/ur/socket.hpp"
#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Questions and answers over a connection, a line of text each. Blocks; not for the control thread.
class TextLines {
 public:
  /// @param whose name of the other end for error messages, as in "the dashboard" @param timeout for each answer
  TextLines(Socket socket, std::string whose, Time timeout)
      : socket_(std::move(socket)), whose_(std::move(whose)), timeout_(timeout) {}

  /// Sends a line and returns the next one that comes. @param question without a line's end in it
  Result<std::string> ask(const std::string& question);
  /// The next line that comes, without its end.
  Result<std::string> line();

 private:
  Socket socket_;
  std::string whose_;
  Time timeout_;
  std::string received_;
};

}  // namespace steadyhand
