#include "steadyhand/core/histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace steadyhand {
namespace {

TEST(Histogram, PercentilesAreThoseOfTheSortedValuesToABinsWidth) {
  std::mt19937 random(1);
  std::lognormal_distribution<double> duration(6.0, 2.0);
  for (int round = 0; round < 20; ++round) {
    Histogram histogram;
    std::vector<double> values;
    for (int i = 0; i < 5000; ++i) {
      values.push_back(std::max(1.0, duration(random)));
      histogram.add(values.back());
    }
    std::sort(values.begin(), values.end());
    for (const double share : {0.01, 0.5, 0.99, 0.999}) {
      const double exact = values[static_cast<std::size_t>(std::ceil(share * 5000.0)) - 1];
      EXPECT_GE(histogram.percentile(share), exact * (1.0 - 1e-12));
      EXPECT_LE(histogram.percentile(share), exact * 1.03);
    }
    EXPECT_EQ(histogram.max(), values.back());
    EXPECT_EQ(histogram.count(), 5000u);
  }
}

TEST(Histogram, TakesWhatIsOutOfItsRange) {
  Histogram histogram;
  EXPECT_EQ(histogram.percentile(0.5), 0.0);
  for (const double us : {0.0, -5.0, 1e30}) histogram.add(us);
  EXPECT_EQ(histogram.count(), 3u);
  EXPECT_EQ(histogram.max(), 1e30);
}

}  // namespace
}  // namespace steadyhand
