#include "steadyhand/geometry/robot/xacro.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string_view>
#include <vector>

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

/// xacro's error in one line: from the message to the end, with the files and macros that it names after it. The last
/// line if there is no message, for example if Python itself fails.
std::string reason_in(const std::string& said) {
  std::string last, reason;
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    std::erase_if(line, [](unsigned char c) { return std::iscntrl(c) != 0; });
    if (line.find_first_not_of(' ') == std::string::npos) continue;
    last = line;
    if (line.starts_with("error: ")) {
      reason = line.substr(7);
    } else if (!reason.empty() || line.starts_with("XML parsing error")) {
      reason += (reason.empty() ? "" : "; ") + line;
    }
  }
  if (!reason.empty()) return reason;
  return last.empty() ? "it does not say why" : last;
}

/// xacro asks this Python module of ROS for $(find PACKAGE). Without ROS there is none; this one looks where
/// package:// is looked for, and at the name in package.xml for a package that was copied under another name.
constexpr const char* kFindPackage = R"(import os
import xml.etree.ElementTree


def name_of(folder):
    try:
        return xml.etree.ElementTree.parse(os.path.join(folder, "package.xml")).findtext("name").strip()
    except (AttributeError, OSError, xml.etree.ElementTree.ParseError):
        return None


def get_package_share_directory(package):
    start = above = os.environ["STEADYHAND_URDF_FOLDER"]
    while True:
        if os.path.isdir(os.path.join(above, package)):
            return os.path.join(above, package)
        if name_of(above) == package:
            return above
        if above == os.path.dirname(above):
            raise LookupError(f"$(find {package}): there is no folder '{package}' in {start} or above it")
        above = os.path.dirname(above)
)";

/// A folder with that module, gone afterwards, and the environment in which Python finds it, behind ROS's own.
class FindPackage {
 public:
  explicit FindPackage(const std::filesystem::path& urdf_folder) {
    std::error_code error;
    std::string name = (std::filesystem::temp_directory_path(error) / "steadyhand_xacro_XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) {
      folder_ = name;
      std::filesystem::create_directory(folder_ / "ament_index_python", error);
      std::ofstream(folder_ / "ament_index_python/packages.py") << kFindPackage;
    }
    constexpr std::string_view kPath = "PYTHONPATH=";
    std::string path(kPath);
    for (char** variable = environ; *variable != nullptr; ++variable) {
      if (std::string_view(*variable).starts_with(kPath)) {
        path = *variable;
      } else {
        variables_.emplace_back(*variable);
      }
    }
    variables_.push_back(path + (path == kPath ? "" : ":") + folder_.string());
    variables_.push_back("STEADYHAND_URDF_FOLDER=" + urdf_folder.string());
    for (std::string& variable : variables_) pointers_.push_back(variable.data());
    pointers_.push_back(nullptr);
  }
  ~FindPackage() {
    std::error_code error;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, error);
  }
  FindPackage(const FindPackage&) = delete;
  FindPackage& operator=(const FindPackage&) = delete;

  char* const* environment() const { return pointers_.data(); }

 private:
  std::filesystem::path folder_;
  std::vector<std::string> variables_;
  std::vector<char*> pointers_;
};

}  // namespace

Result<std::string> expand_xacro(const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& reason) {
    return Error{fmt::format("{} cannot be expanded by xacro: {}", file.string(), reason)};
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
  const FindPackage find_package(std::filesystem::absolute(file).lexically_normal().parent_path());
  pid_t child = 0;
  const int failed = posix_spawnp(&child, "xacro", &actions, nullptr, arguments.data(), find_package.environment());
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return refuse(fmt::format("no command 'xacro' ({}); `pip install xacro`", std::strerror(failed)));
  Pipe::close_end(out.write);
  Pipe::close_end(errors.write);
  std::string text, said;
  const bool whole = read_both(out, text, errors, said);
  Pipe::close_end(out.read);  // the child ends if it still writes
  Pipe::close_end(errors.read);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!whole) return refuse("it makes more than 64 MB");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return refuse(reason_in(said));
  return text;
}

}  // namespace steadyhand
