#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Text for people, on its way to a terminal, a file or a pipe that may take it late or never. Whoever says something
/// does not wait: a thread of its own writes, in order. What does not fit any more is dropped, and that is told.
class OutputQueue {
 public:
  static constexpr std::size_t kMost = 1 << 20;  ///< bytes that wait at most

  /// @param descriptor stays open as long as anything waits
  explicit OutputQueue(int descriptor);
  /// As finish(), with a timeout of a second.
  ~OutputQueue();

  /// Any thread. The text should end with a line's end. It is written as printable() has it, whoever named what it
  /// speaks of.
  void say(std::string_view text);
  /// The same without a look at what is in it: escape sequences of our own.
  void draw(std::string picture);
  /// Waits until everything is written, as long as somebody takes something within `timeout`. Once, and last.
  /// @return false if something was dropped, or could not be written
  bool finish(Time timeout);

 private:
  struct Shared;
  static void work(const std::shared_ptr<Shared>& shared);

  std::shared_ptr<Shared> shared_;  ///< the thread's too, which is left behind where nobody reads
  std::thread thread_;
};

}  // namespace steadyhand
