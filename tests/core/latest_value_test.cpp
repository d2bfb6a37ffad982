#include "steadyhand/core/latest_value.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace steadyhand {
namespace {

struct Pair {
  std::uint64_t a = 0, b = 0;
};

TEST(LatestValue, EmptyUntilWritten) {
  LatestValue<Pair> latest;
  Pair value;
  EXPECT_FALSE(latest.read(value));
  latest.write({1, 1});
  latest.write({2, 2});
  EXPECT_TRUE(latest.read(value));
  EXPECT_EQ(value.a, 2u);
  EXPECT_FALSE(latest.read(value));
  EXPECT_EQ(latest.dropped(), 1u);
}

TEST(LatestValue, NeverTornAndNeverOlder) {
  LatestValue<Pair> latest;
  constexpr std::uint64_t kWrites = 1'000'000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kWrites; ++i) latest.write({i, ~i});
  });
  Pair value;
  std::uint64_t last = 0, reads = 0;
  while (last < kWrites) {
    if (!latest.read(value)) continue;
    ++reads;
    ASSERT_EQ(value.b, ~value.a);
    ASSERT_GT(value.a, last);
    last = value.a;
  }
  writer.join();
  EXPECT_EQ(reads + latest.dropped(), kWrites);
}

}  // namespace
}  // namespace steadyhand
