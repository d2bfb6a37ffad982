#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <vector>

namespace steadyhand {

/// A bounded queue from one writer thread to one reader thread; neither waits or allocates. When the queue is full,
/// new entries are dropped and counted. For data that must arrive in order: hand samples on their way to the gate,
/// messages to the recorder.
template <typename T>
class SpscRing {
 public:
  /// @param capacity rounded up to a power of two
  explicit SpscRing(std::size_t capacity) : slots_(std::bit_ceil(capacity)) {}

  /// Writer thread. False if the ring is full.
  bool push(const T& value) {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == slots_.size()) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    slots_[head & (slots_.size() - 1)] = value;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Reader thread. False if the ring is empty.
  bool pop(T& value) {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    value = slots_[tail & (slots_.size() - 1)];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  /// Values that did not fit. Any thread.
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::vector<T> slots_;
  alignas(64) std::atomic<std::uint64_t> head_{0};
  alignas(64) std::atomic<std::uint64_t> tail_{0};
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace steadyhand
