#include "steadyhand/core/spsc_ring.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace steadyhand {
namespace {

TEST(SpscRing, KeepsOrderAndDropsTheNewestWhenFull) {
  SpscRing<int> ring(3);  // rounded up to 4
  for (int i = 0; i < 6; ++i) EXPECT_EQ(ring.push(i), i < 4);
  EXPECT_EQ(ring.dropped(), 2u);
  int value = -1;
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(ring.pop(value));
    EXPECT_EQ(value, i);
  }
  EXPECT_FALSE(ring.pop(value));
}

TEST(SpscRing, NothingIsLostTornOrTwiceBetweenThreads) {
  struct Complements {
    std::uint64_t a = 0, b = ~0ull;
  };
  SpscRing<Complements> ring(64);
  constexpr std::uint64_t kCount = 300'000;
  std::thread writer([&] {
    for (std::uint64_t i = 0; i < kCount;) {
      if (ring.push({i, ~i})) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  Complements value;
  for (std::uint64_t i = 0; i < kCount;) {
    if (!ring.pop(value)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(value.a, i);
    ASSERT_EQ(value.b, ~i);
    ++i;
  }
  writer.join();
}

}  // namespace
}  // namespace steadyhand
