// LatestValue and SpscRing under the C++ memory model, every interleaving and every value that a load may see up to a
// bound, by Relacy (Debian: relacy-dev). Then each memory order of the two headers is weakened in turn, and that must
// be noticed.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <memory>
#include <ostream>
#include <source_location>
#include <streambuf>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

// Behind all others: it leaves macros with their names.
#include <relacy/relacy.hpp>
#undef new
#undef delete
#undef malloc
#undef free
#undef memory_order_relaxed
#undef memory_order_consume
#undef memory_order_acquire
#undef memory_order_release
#undef memory_order_acq_rel
#undef memory_order_seq_cst

namespace {

/// A memory order, and its place in the code.
struct Site {
  std::string_view file;
  unsigned line = 0;
  std::memory_order order = std::memory_order_relaxed;
  bool operator==(const Site&) const = default;
};
// No allocations: Relacy has its own memory while it runs.
std::array<Site, 32> g_sites;   // seen so far
std::size_t g_site_count = 0;   // entries of it
Site g_weakened;                // this one is weakened
std::memory_order g_instead{};  // to that

rl::memory_order order_at(std::memory_order order, const std::source_location& at) {
  const std::string_view path = at.file_name();
  const Site site{path.substr(path.rfind('/') + 1), at.line(), order};
  const auto end = g_sites.begin() + g_site_count;
  if (std::find(g_sites.begin(), end, site) == end) g_sites.at(g_site_count++) = site;
  switch (site == g_weakened ? g_instead : order) {
    case std::memory_order_relaxed:
      return rl::mo_relaxed;
    case std::memory_order_acquire:
      return rl::mo_acquire;
    case std::memory_order_release:
      return rl::mo_release;
    case std::memory_order_acq_rel:
      return rl::mo_acq_rel;
    default:
      return rl::mo_seq_cst;
  }
}

rl::debug_info here(const std::source_location& at) { return {at.function_name(), at.file_name(), at.line()}; }

}  // namespace

/// std, but with atomics that Relacy watches.
namespace watched_std {
using namespace std;

template <typename T>
class atomic {
 public:
  using Place = std::source_location;
  atomic(T value) : value_(value) {}
  T load(memory_order order, Place at = Place::current()) const { return value_.load(order_at(order, at), here(at)); }
  void store(T value, memory_order order, Place at = Place::current()) {
    value_.store(value, order_at(order, at), here(at));
  }
  T exchange(T value, memory_order order, Place at = Place::current()) {
    return value_.exchange(value, order_at(order, at), here(at));
  }
  T fetch_add(T value, memory_order order, Place at = Place::current()) {
    return value_.fetch_add(value, order_at(order, at), here(at));
  }

 private:
  rl::atomic<T> value_;
};
}  // namespace watched_std

#define std watched_std
#include "steadyhand/core/latest_value.hpp"
#include "steadyhand/core/spsc_ring.hpp"
#undef std

namespace {

/// Two numbers that belong together, in memory that Relacy watches for races.
struct Pair {
  Pair() : a(0), b(0) {}
  explicit Pair(int value) : a(value), b(value) {}
  Pair(const Pair& other) : a(0), b(0) { *this = other; }
  Pair& operator=(const Pair& other) {
    a($) = other.a($).load();
    b($) = other.b($).load();
    return *this;
  }
  int value() const {
    const int first = a($), second = b($);
    RL_ASSERT(first == second);
    return first;
  }
  mutable rl::var<int> a, b;
};

using steadyhand::LatestValue;
using steadyhand::SpscRing;

/// One thread writes 1, 2, 3, 4, another reads: what comes is whole, grows, and is the newest in the end.
struct HandsOver : rl::test_suite<HandsOver, 2> {
  static constexpr int kWrites = 4, kReads = 2;
  std::unique_ptr<LatestValue<Pair>> latest;
  int last = 0, taken = 0;

  void before() { latest = std::make_unique<LatestValue<Pair>>(); }
  void read() {
    Pair value;
    if (!latest->read(value)) return;
    RL_ASSERT(value.value() > last);
    last = value.value();
    ++taken;
  }
  void thread(unsigned index) {
    if (index == 0) {
      for (int i = 1; i <= kWrites; ++i) latest->write(Pair(i));
    } else {
      for (int i = 0; i < kReads; ++i) read();
    }
  }
  void after() {
    read();
    RL_ASSERT(last == kWrites);
    RL_ASSERT(latest->dropped() + static_cast<unsigned>(taken) == kWrites);
    latest.reset();  // while Relacy has the memory
  }
};

/// One thread pushes 1, 2, 3, 4 into a ring of two, another pops: what comes is whole, in order, and with what was
/// dropped all that was pushed.
struct Queues : rl::test_suite<Queues, 2> {
  static constexpr int kPushes = 4, kPops = 3;
  std::unique_ptr<SpscRing<Pair>> ring;
  int last = 0, taken = 0;
  unsigned refused = 0;

  void before() { ring = std::make_unique<SpscRing<Pair>>(2); }
  bool pop() {
    Pair value;
    if (!ring->pop(value)) return false;
    RL_ASSERT(value.value() > last);
    last = value.value();
    ++taken;
    return true;
  }
  void thread(unsigned index) {
    if (index == 0) {
      for (int i = 1; i <= kPushes; ++i) refused += !ring->push(Pair(i));
    } else {
      for (int i = 0; i < kPops; ++i) pop();
    }
  }
  void after() {
    while (pop()) {
    }
    RL_ASSERT(ring->dropped() == refused);
    RL_ASSERT(taken + static_cast<int>(refused) == kPushes);
    ring.reset();
  }
};

struct Silent : std::streambuf {
  int overflow(int c) override { return c; }
};

/// True if no execution breaks it: all those with up to five switches between the threads besides the necessary ones,
/// and with every value that a load may see.
template <typename Test>
bool holds() {
  Silent silent;
  std::ostream said(&silent);
  rl::test_params params;
  params.search_type = rl::fair_context_bound_scheduler_type;
  params.context_bound = 5;
  params.output_stream = params.progress_stream = &said;
  const bool held = rl::simulate<Test>(params);
  std::printf("%llu executions\n", static_cast<unsigned long long>(params.stop_iteration));
  return held;
}

std::vector<std::memory_order> weaker_than(std::memory_order order) {
  if (order == std::memory_order_acq_rel)
    return {std::memory_order_acquire, std::memory_order_release, std::memory_order_relaxed};
  if (order == std::memory_order_relaxed) return {};
  return {std::memory_order_relaxed};
}

std::string name_of(std::memory_order order) {
  return std::vector<std::string>{
      "relaxed", "consume", "acquire", "release", "acq_rel", "seq_cst"}[static_cast<std::size_t>(order)];
}

/// Weakened in turn: which of them went unnoticed.
template <typename Test>
std::vector<std::string> unnoticed() {
  g_weakened = {};
  g_site_count = 0;
  EXPECT_TRUE(holds<Test>());
  std::vector<std::string> missed;
  const std::vector<Site> sites(g_sites.begin(), g_sites.begin() + g_site_count);
  for (const Site& site : sites) {
    for (const std::memory_order instead : weaker_than(site.order)) {
      g_weakened = site;
      g_instead = instead;
      const bool noticed = !holds<Test>();
      const std::string words = std::string(site.file) + ":" + std::to_string(site.line) + " " + name_of(site.order) +
                                " -> " + name_of(instead);
      std::printf("%s: %s\n", words.c_str(), noticed ? "noticed" : "UNNOTICED");
      if (!noticed) missed.push_back(words);
    }
  }
  g_weakened = {};
  return missed;
}

TEST(WeakMemory, LatestValueNeedsEveryOrderThatItHas) { EXPECT_EQ(unnoticed<HandsOver>(), std::vector<std::string>{}); }

TEST(WeakMemory, SpscRingNeedsEveryOrderThatItHas) { EXPECT_EQ(unnoticed<Queues>(), std::vector<std::string>{}); }

}  // namespace
