#pragma once

#include <atomic>
#include <cstdint>
#include <type_traits>

namespace steadyhand {

/// Hands the newest value from one writer thread to one reader thread; neither waits, and older values are dropped and
/// counted. Triple buffer: writer and reader each own a slot, the third is exchanged atomically.
template <typename T>
class LatestValue {
 public:
  /// Writer thread. Overwrites a value that the reader has not taken yet.
  void write(const T& value) {
    slots_[write_slot_] = value;
    const std::uint8_t previous = shared_.exchange(write_slot_ | kFresh, std::memory_order_acq_rel);
    if (previous & kFresh) dropped_.fetch_add(1, std::memory_order_relaxed);
    write_slot_ = previous & kSlot;
  }

  /// Reader thread. True if there is a value that has not been read; copies it to `value`.
  bool read(T& value) {
    if (!(shared_.load(std::memory_order_relaxed) & kFresh)) return false;
    read_slot_ = shared_.exchange(read_slot_, std::memory_order_acq_rel) & kSlot;
    value = slots_[read_slot_];
    return true;
  }

  /// Values that were overwritten before they were read. Any thread.
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::uint8_t kFresh = 4, kSlot = 3;
  T slots_[3]{};
  std::uint8_t write_slot_ = 0, read_slot_ = 1;
  std::atomic<std::uint8_t> shared_{2};
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace steadyhand
