// Recordings of two hands.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "steadyhand/files/input/recording.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

const std::vector<std::string> kSides{"left", "right"};

Result<Recording> load(const std::string& name, const std::string& content, const RecordingOptions& options) {
  const TemporaryFolder folder;
  return load_recording(folder.write(name, content), options);
}

/// A track of poses at these times, ms, at (x, 0, 0).
std::string hand_track(const std::string& key, const std::vector<double>& times, double x) {
  std::string poses;
  for (const double t : times) {
    poses += fmt::format(R"({}{{"position":{{"x":{},"y":0,"z":0}},"rotation":{{"x":0,"y":0,"z":0}},"timestamp":{}}})",
                         poses.empty() ? "" : ",", x, t);
  }
  return fmt::format(R"("{}":{{"poses":[{}]}})", key, poses);
}
std::string both(const std::string& first, const std::string& second) { return "{" + first + "," + second + "}"; }

/// "1:12 0:15": tool and ms of each sample.
std::string order(const Result<Recording>& recording) {
  if (!recording) return recording.error().message;
  std::string text;
  for (const OperatorSample& sample : recording->samples) {
    text += fmt::format("{}{}:{:g}", text.empty() ? "" : " ", sample.tool, 1e3 * to_seconds(sample.stamp.hand));
  }
  return text;
}

TEST(TwoHands, AreMergedInOrderOfTimeAndMoveTheToolOnTheirSide) {
  const std::string file = both(hand_track("rhand", {105, 115, 125}, 1.0), hand_track("lhand", {100, 115}, 2.0));
  const auto recording = load("hands.json", file, {.tools = kSides});
  EXPECT_EQ(order(recording), "0:0 1:5 0:15 1:15 1:25");
  ASSERT_TRUE(recording);
  EXPECT_EQ(recording->track, "lhand,rhand");
  EXPECT_EQ(recording->note, "");
  for (const OperatorSample& sample : recording->samples) {
    EXPECT_EQ(sample.X_operator_hand.p.y(), sample.tool == 0 ? -2.0 : -1.0);
    EXPECT_EQ(sample.stamp.made, sample.stamp.hand);
  }
  EXPECT_EQ(order(load("hands.json", file, {.tools = {"right_arm", "left_arm"}})), "1:0 0:5 0:15 1:15 0:25");
  EXPECT_EQ(order(load("hands.json", file, {.from = 0.004, .until = 0.02, .tools = kSides})), "1:0 0:10 1:10");
}

TEST(TwoHands, OfACsvHaveTheirNamesBeforeTheColumns) {
  const std::string file =
      "t,left_px,left_py,left_pz,left_qx,left_qy,left_qz,left_qw,left_clutch,"
      "right_px,right_py,right_pz,right_qx,right_qy,right_qz,right_qw\n"
      "5.00,1,2,3,0,0,0,1,0,4,5,6,0,0,0,1\n"
      "5.01,,,,,,,,,4,5,7,0,0,0,1\n"
      "5.02,1,2,4,0,0,0,1,1,,,,,,,\n";
  const auto recording = load("hands.csv", file, {.tools = kSides});
  EXPECT_EQ(order(recording), "0:0 1:0 1:10 0:20");
  ASSERT_TRUE(recording);
  EXPECT_FALSE(recording->samples[0].clutch);
  EXPECT_TRUE(recording->samples[1].clutch) << "without a column";
  EXPECT_EQ(recording->samples[2].X_operator_hand.p, Vector3(4, 5, 7));
  EXPECT_EQ(recording->samples[3].X_operator_hand.p, Vector3(1, 2, 4));
  EXPECT_EQ(order(load("hands.csv", file, {.track = "left"})), "0:0 0:20");
}

TEST(TwoHands, OneMovesOneToolAndANoteSaysWhich) {
  const std::string file = both(hand_track("lhand", {0, 10}, 2.0), hand_track("rhand", {0, 10, 20}, 1.0));
  const auto recording = load("hands.json", file, {});
  EXPECT_EQ(order(recording), "0:0 0:10 0:20");
  ASSERT_TRUE(recording);
  EXPECT_EQ(recording->track, "rhand");
  EXPECT_NE(recording->note.find("hands.json: the hand rhand is used, and lhand is not; --track selects"),
            std::string::npos);
  EXPECT_EQ(order(load("hands.json", "{" + hand_track("rhand", {0, 10}, 1.0) + "}", {.tools = kSides})), "1:0 1:10");
  EXPECT_EQ(order(load("hands.json", "{" + hand_track("stick", {0, 10}, 1.0) + "}", {.tools = kSides})), "0:0 0:10");
}

TEST(TwoHands, AreChosenInTheOrderOfTheTools) {
  const std::string file = both(hand_track("a", {0, 10}, 1.0), hand_track("b", {0, 20}, 1.0));
  const auto chosen = [&](const std::string& wanted) {
    return order(load("hands.json", file, {.track = wanted, .tools = {"near", "far"}}));
  };
  EXPECT_EQ(chosen("b,a"), "0:0 1:0 1:10 0:20");
  EXPECT_EQ(chosen(",a"), "1:0 1:10");
  EXPECT_EQ(chosen("b"), "0:0 0:20");
  EXPECT_NE(
      chosen("").find("none of its tracks is named after a tool, or left or right as a tool; its tracks are: a, b. "
                      "Choose one for each of the tools near, far, as in --track A,B"),
      std::string::npos);
  EXPECT_NE(chosen("a,c").find("has no track \"c\"; its tracks are: a, b"), std::string::npos);
  EXPECT_NE(chosen("a,a").find("names the hand \"a\" twice"), std::string::npos);
  EXPECT_NE(chosen("a,b,a").find("names 3 hands; the robot has the tools near, far"), std::string::npos);
  EXPECT_NE(chosen(",").find("names no hand; its tracks are: a, b"), std::string::npos);
}

TEST(TwoHands, RefusalsSayWhereAndWhy) {
  const std::string header =
      "t,left_px,left_py,left_pz,left_qx,left_qy,left_qz,left_qw,right_px,right_py,right_pz,right_qx,right_qy,right_qz,"
      "right_qw\n";
  const std::string row = ",1,2,3,0,0,0,1,1,2,3,0,0,0,1\n";
  const struct {
    std::string name, content, says;
  } cases[] = {
      {"h.json", both(hand_track("lhand", {0, 10}, 1.0), hand_track("rhand", {}, 1.0)),
       "h.json: the hand \"rhand\" has 0 samples; it needs at least 2"},
      {"h.json", both(hand_track("lhand", {0}, 1.0), hand_track("rhand", {0, 10}, 1.0)),
       "the hand \"lhand\" has 1 sample; it needs at least 2"},
      {"h.json", both(hand_track("lhand", {0, 10}, 1.0), hand_track("lhand", {0, 10}, 2.0)),
       "has two tracks \"lhand\"; each needs its own name"},
      {"h.json", both(hand_track("lhand", {0, 10}, 1.0), hand_track("rhand", {10, 0}, 1.0)),
       "rhand.poses[1]: time goes backwards, from 0.01 s to 0 s"},
      {"h.json", both(hand_track("lhand", {0, 10}, 1.0), hand_track("rhand", {1e9, 1e9 + 10}, 1.0)),
       "rhand.poses[0]: time 1000000 s is 1000000 s after the first sample"},
      {"h.json", both(hand_track("lhand", {0, 10}, 1.0), hand_track("my_left", {0, 10}, 1.0)),
       "several of its tracks fit the tool \"left\"; its tracks are: lhand, my_left. Choose one for each"},
      {"h.csv", header + "0" + row + "0.01,1,2,3,0,0,0,1,nan,2,3,0,0,0,1\n",
       "h.csv:3: column right_px is \"nan\"; it must be a finite number"},
      {"h.csv", header + "0" + row + "0.01,1,2,3,0,0,0,1,1,2,,0,0,0,1\n",
       "h.csv:3: column right_pz is \"\"; it must be a finite number"},
      {"h.csv", header + "0" + row + "0" + row, "h.csv:3: time 0 s repeats that of the sample before"},
      {"h.csv", "t,left_px,left_px\n", "h.csv:1: column \"left_px\" appears twice"},
      {"h.csv", "t,left_px,left_py,left_pz,left_qx,left_qy,left_qz,left_qw,right_px\n",
       "h.csv:1: missing columns right_py, right_pz, right_qx, right_qy, right_qz, right_qw"},
      {"h.csv", "t,left_px,left_size\n", "h.csv:1: unknown column \"left_size\""},
      {"h.csv", header + "0,1,2,3,0,0,0,1,,,,,,,\n0.01,1,2,3,0,0,0,1,,,,,,,\n",
       "the hand \"right\" has 0 samples; it needs at least 2"},
  };
  for (const auto& [name, content, says] : cases) {
    const auto recording = load(name, content, {.tools = kSides});
    ASSERT_FALSE(recording) << says;
    EXPECT_NE(recording.error().message.find(says), std::string::npos) << recording.error().message;
  }
}

}  // namespace
}  // namespace steadyhand
