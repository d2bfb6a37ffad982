#include "steadyhand/replay/replay.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace steadyhand {
namespace {

/// A hand of somebody else's making, of which nothing has been checked yet.
TEST(Replay, RefusesWhatIsNoRecordingWithTheReason) {
  const RobotModel model = *open_robot("ur5e");
  ReplaySettings settings;
  settings.pipeline = PipelineSettings(*load_profile("tracking"));
  Recording good;
  for (int i = 0; i < 20; ++i) {
    good.samples.emplace_back();
    good.samples.back().stamp.hand = from_seconds(0.05 * i);
  }
  const Result<ReplayResult> done = replay(model, good, settings, {});
  ASSERT_TRUE(done);
  EXPECT_EQ(done->steps.size(), 20u);

  const struct {
    std::function<void(Recording&, ReplaySettings&)> spoil;
    const char* message;
  } cases[] = {
      {[](Recording& r, ReplaySettings&) { r.samples.clear(); }, "holds 0 samples; a recording needs at least 2"},
      {[](Recording& r, ReplaySettings&) { r.samples.resize(1); }, "holds 1 samples; a recording needs at least 2"},
      {[](Recording& r, ReplaySettings&) { r.samples[7].stamp.hand = Time(0); }, "sample 7 is at 0 s, and that before"},
      {[](Recording& r, ReplaySettings&) { r.samples[3].X_operator_hand.p.x() = std::nan(""); }, "must be finite"},
      {[](Recording&, ReplaySettings& s) { s.command_rate_hz = std::nan(""); }, "the arm's rate is nan Hz; it must be"},
      {[](Recording&, ReplaySettings& s) { s.command_rate_hz = std::numeric_limits<double>::infinity(); },
       "the arm's rate is inf Hz; it must be"},
      {[](Recording&, ReplaySettings& s) { s.pipeline.rate_hz = 1000.0; }, "rate is 1000 Hz; it must be from 1 to 500"},
  };
  for (const auto& [spoil, message] : cases) {
    Recording recording = good;
    ReplaySettings spoilt = settings;
    spoil(recording, spoilt);
    const Result<ReplayResult> refused = replay(model, recording, spoilt, {});
    ASSERT_FALSE(refused) << message;
    EXPECT_NE(refused.error().message.find(message), std::string::npos) << refused.error().message;
  }
}

}  // namespace
}  // namespace steadyhand
