#pragma once

#ifdef __STDCPP_THREADS__
#include <mutex>
#endif

namespace steadyhand {

#ifdef __STDCPP_THREADS__
using Mutex = std::mutex;
using Lock = std::lock_guard<std::mutex>;
#else
/// For programs with one thread (WebAssembly in a browser's Worker), whose standard library has no mutex.
struct Mutex {};
struct Lock {
  explicit Lock(Mutex&) {}
  ~Lock() {}
};
#endif

}  // namespace steadyhand
