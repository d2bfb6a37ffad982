#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>

#include "steadyhand/session/live/realtime_threads.hpp"

namespace steadyhand {
namespace {

TEST(AwakeProcessors, AskTheKernelForNoLatencyOrSayWhyNot) {
  const AwakeProcessors awake;
  if (!awake.refused().empty()) {
    EXPECT_NE(awake.refused().find("/dev/cpu_dma_latency"), std::string::npos);
    return;
  }
  const int file = open("/dev/cpu_dma_latency", O_RDONLY | O_CLOEXEC);
  ASSERT_GE(file, 0);
  std::int32_t microseconds = -1;  // what the kernel grants to all who asked
  EXPECT_EQ(read(file, &microseconds, sizeof(microseconds)), static_cast<ssize_t>(sizeof(microseconds)));
  close(file);
  EXPECT_EQ(microseconds, 0);
}

}  // namespace
}  // namespace steadyhand
