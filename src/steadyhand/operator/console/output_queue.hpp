#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Text for users, on its way to a terminal, a file or a pipe that may be slow or blocked. say() does not wait: the
/// queue's thread writes, in order. Text that does not fit is dropped, and the drop is reported.
class OutputQueue {
 public:
  static constexpr std::size_t kMost = 1 << 20;  ///< bytes that wait at most

  /// @param descriptor stays open as long as anything waits
  explicit OutputQueue(int descriptor);
  /// As finish(), with a timeout of a second.
  ~OutputQueue();

  /// Any thread. The text should end with a line's end. It is written as printable() has it, because it may contain
  /// foreign names.
  void say(std::string_view text);
  /// The same without printable(): for our escape sequences.
  void draw(std::string picture);
  /// Waits until everything is written, as long as the reader takes something within `timeout`. Once, and last.
  /// @return false if something was dropped, or could not be written
  bool finish(Time timeout);

 private:
  struct Shared;
  static void work(const std::shared_ptr<Shared>& shared);

  std::shared_ptr<Shared> shared_;  ///< also the thread's, which is detached if nothing reads
  std::thread thread_;
};

}  // namespace steadyhand
