#include "steadyhand/core/configuration.hpp"

#include <gtest/gtest.h>

#include "steadyhand/core/lanes.hpp"

namespace steadyhand {
namespace {

TEST(Configuration, VectorsFillTheRegistersOfTheProcessorThatIsBuiltFor) {
#if defined(__AVX512F__)
  EXPECT_EQ(kLanes, 8);
#elif defined(__AVX__)
  EXPECT_EQ(kLanes, 4);
#else
  EXPECT_EQ(kLanes, 2);
#endif
}

}  // namespace
}  // namespace steadyhand
