#include "steadyhand/robot/xacro.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

extern char** environ;

namespace steadyhand {

namespace {

constexpr std::size_t kMostBytes = 64u << 20;

/// Both ends of a pipe, which close with it.
struct Pipe {
  int read = -1, write = -1;

  Pipe() {
    std::array<int, 2> ends;
    if (pipe2(ends.data(), O_CLOEXEC) == 0) {
      read = ends[0];
      write = ends[1];
    }
  }
  ~Pipe() {
    close_end(read);
    close_end(write);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  static void close_end(int& end) {
    if (end >= 0) close(end);
    end = -1;
  }
};

/// Reads both to their ends; false if that is too much.
bool read_both(Pipe& first, std::string& first_text, Pipe& second, std::string& second_text) {
  std::array<char, 65536> buffer;
  const auto read_some = [&](Pipe& from, short events, std::string& text) {
    if (events == 0) return;
    const ssize_t bytes = read(from.read, buffer.data(), buffer.size());
    if (bytes > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(bytes));
    } else if (bytes == 0 || errno != EINTR) {
      Pipe::close_end(from.read);
    }
  };
  while (first.read >= 0 || second.read >= 0) {
    std::array<pollfd, 2> ends{{{first.read, POLLIN, 0}, {second.read, POLLIN, 0}}};  // poll ignores what is -1
    if (poll(ends.data(), ends.size(), -1) < 0 && errno != EINTR) return false;
    read_some(first, ends[0].revents, first_text);
    read_some(second, ends[1].revents, second_text);
    if (first_text.size() + second_text.size() > kMostBytes) return false;
  }
  return true;
}

/// The last line that says anything.
std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of(" \t\r\n");
  if (end == std::string::npos) return "it does not say why";
  const std::size_t begin = text.find_last_of('\n', end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1,
                     end - (begin == std::string::npos ? 0 : begin + 1) + 1);
}

}  // namespace

Result<std::string> expand_xacro(const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& reason) {
    return Error{fmt::format("{} holds xacro macros, and cannot be expanded: {}", file.string(), reason)};
  };
  Pipe out, errors;
  if (out.read < 0 || errors.read < 0) return refuse(std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out.write, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors.write, STDERR_FILENO);
  std::string command = "xacro", name = std::filesystem::absolute(file).string();
  std::array<char*, 3> arguments{command.data(), name.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, "xacro", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return refuse(fmt::format("no command 'xacro' ({}); `pip install xacro`", std::strerror(failed)));
  Pipe::close_end(out.write);
  Pipe::close_end(errors.write);
  std::string text, said;
  const bool whole = read_both(out, text, errors, said);
  Pipe::close_end(out.read);  // so that it ends
  Pipe::close_end(errors.read);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!whole) return refuse("it makes more than 64 MB");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return refuse("xacro says: " + last_line(said));
  return text;
}

}  // namespace steadyhand
