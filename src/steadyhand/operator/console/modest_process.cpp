#include "steadyhand/operator/console/modest_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

namespace steadyhand {

namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr rlim_t kMostMemory = RLIM_INFINITY;  // sanitizers reserve terabytes, and use little
#else
constexpr rlim_t kMostMemory = rlim_t(2) << 30;  // bytes of address space
#endif
constexpr rlim_t kMostOutput = 256 << 20;  // bytes of a file
constexpr std::size_t kMostError = 4096;   // bytes
constexpr int kLookAround = 20;            // ms between two looks at whether to end

/// Both ends closed at the end of their scope and in every other program.
struct Pipe {
  Pipe() { failed = pipe2(ends, O_CLOEXEC) != 0; }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  void close_end(int i) {
    if (ends[i] >= 0) close(ends[i]);
    ends[i] = -1;
  }
  int ends[2] = {-1, -1};
  bool failed;
};

/// Where a program writes to, instead of /dev/null.
struct Outputs {
  int out = -1, err = -1;  ///< descriptors
};

/// With no files but stdin, stdout and stderr, and signals as any program gets them. @return errno, 0 if it runs
int spawn(const ModestProcess& process, const Outputs& to, short flags, pid_t& child) {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  for (const auto& [from, as] : {std::pair(to.out, STDOUT_FILENO), std::pair(to.err, STDERR_FILENO)}) {
    if (from >= 0) {
      posix_spawn_file_actions_adddup2(&files, from, as);
    } else {
      posix_spawn_file_actions_addopen(&files, as, "/dev/null", O_WRONLY, 0);
    }
  }
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  sigset_t none, usual;
  sigemptyset(&none);
  sigfillset(&usual);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  posix_spawnattr_setflags(&attributes, static_cast<short>(POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | flags));
  std::vector<char*> arguments{const_cast<char*>(process.program.c_str())};
  for (const std::string& argument : process.arguments) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  const int failed = posix_spawnp(&child, process.program.c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  return failed;
}

/// Appends what has come. False at its end.
bool take(int descriptor, std::string& text, std::size_t most) {
  char piece[65536];
  const ssize_t got = read(descriptor, piece, sizeof(piece));
  if (got < 0) return errno == EINTR;
  text.append(piece, std::min(static_cast<std::size_t>(got), most - std::min(most, text.size())));
  return got > 0;
}

}  // namespace

Status run_into(const ModestProcess& process, int file, const std::atomic<bool>& end) {
  Pipe err;
  pid_t child = -1;
  const int failed = err.failed ? errno : spawn(process, {file, err.ends[1]}, 0, child);
  if (failed != 0) return Error{fmt::format("{} cannot be run: {}", process.program, std::strerror(failed))};
  err.close_end(1);
  std::string error;
  while (!end && err.ends[0] >= 0) {
    pollfd ready{err.ends[0], POLLIN, 0};
    if (poll(&ready, 1, kLookAround) <= 0) continue;
    if (!take(err.ends[0], error, kMostError)) err.close_end(0);
  }
  if (end) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (end) return Error{"the program ends"};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ) return Error{"too much to be shown"};
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return Done{};
  while (!error.empty() && error.back() == '\n') error.pop_back();
  if (error.empty()) return Error{"it was ended for lack of memory, or by a user"};
  return Error{error};
}

void launch(const ModestProcess& process) {
  pid_t child = -1;
  (void)spawn(process, {}, POSIX_SPAWN_SETSID, child);
}

void be_modest() {
  const rlimit memory{kMostMemory, kMostMemory};
  (void)setrlimit(RLIMIT_AS, &memory);
  const rlimit output{kMostOutput, kMostOutput};
  (void)setrlimit(RLIMIT_FSIZE, &output);
  (void)setpriority(PRIO_PROCESS, 0, 19);
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::ofstream("/proc/self/oom_score_adj") << 1000;
}

}  // namespace steadyhand
