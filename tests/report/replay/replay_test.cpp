#include "steadyhand/report/replay/replay.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "steadyhand/files/config/open.hpp"

namespace steadyhand {
namespace {

/// A hand of unknown origin, of which nothing has been checked yet.
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

/// A wall that appears after a second, across the path that the glass has taken by then, and disappears again.
TEST(Replay, KnowsWhatStoodAroundTheArmAtEachTime) {
  const RobotModel model = *open_robot("ur5e");
  ReplaySettings settings;
  settings.pipeline = PipelineSettings(*load_profile("tracking"));
  Recording hand;
  for (int i = 0; i <= 80; ++i) {
    OperatorSample& sample = hand.samples.emplace_back();
    sample.stamp.hand = from_seconds(0.05 * i);
    sample.X_operator_hand.p = {0.0, std::min(0.6, 0.2 * 0.05 * i), 0.0};
    sample.clutch = sample.tracked = true;
  }
  const auto way = [&] {
    const Result<ReplayResult> done = replay(model, hand, settings, {});
    EXPECT_TRUE(done) << done.error().message;
    return done->steps;
  };
  const auto alone = way();
  const Vector3 begin = alone.front().tools[0].X_base_planned.p, end = alone.back().tools[0].X_base_planned.p;
  ASSERT_GT((end - begin).norm(), 0.2);
  CellObject wall;
  wall.name = "wall";
  wall.shape = Shape::box({0.5, 0.01, 0.5});
  wall.origin = Eigen::Translation3d(end) * Quaternion::FromTwoVectors(Vector3::UnitY(), end - begin);
  settings.cells = {{from_seconds(-1.0), {"of the session", {}}}, {from_seconds(1.0), {"walled", {wall}}}};
  const auto held = way();
  EXPECT_TRUE(held[10].object_distances.empty());
  ASSERT_EQ(held.back().object_distances.size(), 1u);
  EXPECT_NEAR(held.back().object_distances[0].second, wall.margin + PlannerSettings().clearance, 1e-3);
  EXPECT_GT((held.back().tools[0].X_base_planned.p - end).norm(), 0.04);
  settings.cells.push_back({from_seconds(3.0), {"free again", {}}});
  EXPECT_LT((way().back().tools[0].X_base_planned.p - end).norm(), 5e-3);

  settings.cells[1].cell.objects[0].margin = std::nan("");
  const Result<ReplayResult> refused = replay(model, hand, settings, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message.find("cell at 1.000 s: cell 'walled': object 'wall': the margin is nan m"), 0u)
      << refused.error().message;
}

}  // namespace
}  // namespace steadyhand
