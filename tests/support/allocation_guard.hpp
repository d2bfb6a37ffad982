#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

/// Counts heap allocations of this thread while a guard lives. Include in exactly one file of a test program: it
/// replaces the global operator new. (malloc called by C code is not seen.)
namespace steadyhand {

inline thread_local bool counting_allocations = false;
inline thread_local std::size_t allocation_count = 0;

class AllocationGuard {
 public:
  AllocationGuard() {
    allocation_count = 0;
    counting_allocations = true;
  }
  ~AllocationGuard() { counting_allocations = false; }
  AllocationGuard(const AllocationGuard&) = delete;
  AllocationGuard& operator=(const AllocationGuard&) = delete;

  std::size_t count() const { return allocation_count; }
};

inline void* counted_or_null(std::size_t size, std::size_t alignment) noexcept {
  if (counting_allocations) ++allocation_count;
  const std::size_t rounded = (size + alignment - 1) / alignment * alignment;
  return std::aligned_alloc(alignment, rounded > 0 ? rounded : alignment);
}

inline void* counted_allocation(std::size_t size, std::size_t alignment) {
  if (void* memory = counted_or_null(size, alignment)) return memory;
  throw std::bad_alloc();
}

}  // namespace steadyhand

// Inlined on one side only, gcc would see free() meet a pointer of operator new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  return steadyhand::counted_allocation(size, alignof(std::max_align_t));
}
[[gnu::noinline]] void* operator new[](std::size_t size) {
  return steadyhand::counted_allocation(size, alignof(std::max_align_t));
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  return steadyhand::counted_allocation(size, static_cast<std::size_t>(alignment));
}
[[gnu::noinline]] void* operator new[](std::size_t size, std::align_val_t alignment) {
  return steadyhand::counted_allocation(size, static_cast<std::size_t>(alignment));
}
// The sanitizers' own would meet our delete.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return steadyhand::counted_or_null(size, alignof(std::max_align_t));
}
[[gnu::noinline]] void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return steadyhand::counted_or_null(size, alignof(std::max_align_t));
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
