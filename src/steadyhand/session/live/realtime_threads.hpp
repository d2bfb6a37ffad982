#pragma once

#include <string>

namespace steadyhand {

/// Keeps the program's memory from being paged out. @return empty if it worked, else why not and what would help
std::string lock_memory();

/// Real-time priorities of a session's threads: what waits least comes first.
constexpr int kControlPriority = 80, kPlannerPriority = 60, kServerPriority = 40;

/// Gives the calling thread a real-time priority (SCHED_FIFO), 1 to 99; where the user may not, as early turns as
/// anybody may have. @return as lock_memory
std::string make_realtime(int priority);

/// While it lives, the processors do not sleep (PM QoS: Linux' /dev/cpu_dma_latency). Where they do, above all in
/// virtual machines, waking them takes up to milliseconds.
class AwakeProcessors {
 public:
  AwakeProcessors();
  ~AwakeProcessors();
  AwakeProcessors(const AwakeProcessors&) = delete;
  AwakeProcessors& operator=(const AwakeProcessors&) = delete;

  /// As lock_memory.
  const std::string& refused() const { return refused_; }

 private:
  int latency_;  ///< file descriptor, or -1
  std::string refused_;
};

/// The calling thread's name in top and gdb; at most 15 characters.
void name_thread(const char* name);

}  // namespace steadyhand
