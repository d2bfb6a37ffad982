#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>

#include "steadyhand/files/input/recording.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

const std::filesystem::path kExamples = std::filesystem::path(STEADYHAND_DEPS) / "node_modules/super-hands/examples";

Result<Recording> load_json(const std::string& content, const std::string& track = "") {
  const TemporaryFolder folder;
  return load_recording(folder.write("hand.json", content), {.track = track});
}

/// A pose without rotation at the origin, and with other text in the place of one of its values.
std::string pose(double t_ms, const std::string& position = R"({"x":0,"y":0,"z":0})",
                 const std::string& rotation = R"({"x":0,"y":0,"z":0})") {
  return fmt::format(R"({{"position":{},"rotation":{},"timestamp":{}}})", position, rotation, t_ms);
}

std::string file_of(const std::string& poses, const std::string& key = "rhand") {
  return fmt::format(R"({{"{}":{{"poses":[{}],"events":[]}}}})", key, poses);
}

TEST(AFrame, LoadsEveryBundledRecording) {
  int tracks = 0;
  for (const auto* file : {"physics/demo-recording.json", "physics/demo-laser.json", "events/demo-recording.json"}) {
    for (const auto* track : {"rhand", "lhand", "camera"}) {
      const auto recording = load_recording(kExamples / file, {.track = track});
      ASSERT_TRUE(recording) << recording.error().message;
      EXPECT_EQ(recording->track, track);
      EXPECT_GT(recording->duration(), 10.0);
      EXPECT_GT(recording->mean_rate(), 60.0);
      EXPECT_LT(recording->mean_rate(), 120.0);
      EXPECT_EQ(recording->samples.front().stamp.hand, Time(0));
      for (std::size_t i = 0; i < recording->samples.size(); ++i) {
        const OperatorSample& sample = recording->samples[i];
        EXPECT_TRUE(sample.clutch);
        EXPECT_NEAR(sample.X_operator_hand.q.norm(), 1.0, 1e-12);
        if (i > 0) {
          EXPECT_GT(sample.stamp.hand, recording->samples[i - 1].stamp.hand);
        }
      }
      ++tracks;
    }
  }
  EXPECT_EQ(tracks, 9);
}

// The heights of a standing person's head and hand are along z in robot axes only if the axes were turned rightly.
TEST(AFrame, StandsUprightInRobotAxes) {
  const auto head = load_recording(kExamples / "physics/demo-recording.json", {.track = "camera"});
  ASSERT_TRUE(head);
  for (const OperatorSample& sample : head->samples) {
    EXPECT_GT(sample.X_operator_hand.p.z(), 0.8);
    EXPECT_LT(sample.X_operator_hand.p.z(), 1.7);
    EXPECT_GT((sample.X_operator_hand.q * Vector3::UnitZ()).z(), 0.0);  // the head's up never points down
  }
}

TEST(AFrame, TurnsWebXrAxesToRobotAxes) {
  const auto recording = load_json(file_of(pose(100, R"({"x":1,"y":2,"z":3})") + "," +
                                           pose(110, R"({"x":0,"y":0,"z":0})", R"({"x":0,"y":90,"z":0})")));
  ASSERT_TRUE(recording) << recording.error().message;
  const Pose& first = recording->samples[0].X_operator_hand;
  EXPECT_EQ(first.p, Vector3(-3, -1, 2));  // forward is -z, left is -x, up is y
  EXPECT_NEAR(first.q.angularDistance(Quaternion::Identity()), 0.0, 1e-7);
  // A turn to the left about the vertical takes what is ahead to the left.
  const Pose& second = recording->samples[1].X_operator_hand;
  EXPECT_NEAR((second.q * Vector3::UnitX() - Vector3::UnitY()).norm(), 0.0, 1e-15);
  EXPECT_EQ(recording->samples[1].stamp.hand, from_seconds(0.01));
}

// R = Ry Rx Rz, and axes change by conjugation, at random angles, from matrices written out by hand.
TEST(AFrame, ComposesEulerAnglesInOrderYXZ) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> degrees(-180.0, 180.0);
  std::string poses;
  std::vector<Matrix3> expected;
  for (int i = 0; i < 2000; ++i) {
    const double a[3] = {degrees(random), degrees(random), degrees(random)};
    double c[3], s[3];
    for (int k = 0; k < 3; ++k) {
      c[k] = std::cos(a[k] * M_PI / 180);
      s[k] = std::sin(a[k] * M_PI / 180);
    }
    Matrix3 X, Y, Z, A;
    X << 1, 0, 0, 0, c[0], -s[0], 0, s[0], c[0];
    Y << c[1], 0, s[1], 0, 1, 0, -s[1], 0, c[1];
    Z << c[2], -s[2], 0, s[2], c[2], 0, 0, 0, 1;
    A << 0, 0, -1, -1, 0, 0, 0, 1, 0;
    expected.push_back(A * Y * X * Z * A.transpose());
    if (i > 0) poses += ",";
    poses += pose(i, R"({"x":0,"y":0,"z":0})", fmt::format(R"({{"x":{},"y":{},"z":{}}})", a[0], a[1], a[2]));
  }
  const auto recording = load_json(file_of(poses));
  ASSERT_TRUE(recording) << recording.error().message;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR((recording->samples[i].X_operator_hand.q.toRotationMatrix() - expected[i]).norm(), 0.0, 1e-14);
  }
}

TEST(AFrame, ChoosesTheTrack) {
  const std::string poses = pose(0) + "," + pose(1);
  const auto track = [&](const std::string& content, const std::string& wanted) {
    const auto recording = load_json(content, wanted);
    return recording ? recording->track : recording.error().message;
  };
  const std::string two =
      fmt::format(R"({{"left":{{"poses":[{}]}},"head":{{"poses":[{}]}},"title":"x"}})", poses, poses);
  EXPECT_EQ(track(file_of(poses), ""), "rhand");
  EXPECT_EQ(track(file_of(poses, "stick"), ""), "stick");
  EXPECT_EQ(track(two, "head"), "head");
  EXPECT_NE(track(two, "").find("has no track \"rhand\"; its tracks are: head, left"), std::string::npos);
  EXPECT_NE(track(two, "title").find("has no track \"title\"; its tracks are: head, left"), std::string::npos);
  EXPECT_NE(track(file_of(poses, "stick"), "rhand").find("its tracks are: stick"), std::string::npos);
}

struct BadJson {
  std::string name, content, says;
};
void PrintTo(const BadJson& bad, std::ostream* out) { *out << bad.name; }

class AFrameRefusal : public testing::TestWithParam<BadJson> {};

TEST_P(AFrameRefusal, SaysWhereAndWhy) {
  const auto recording = load_json(GetParam().content);
  ASSERT_FALSE(recording);
  EXPECT_NE(recording.error().message.find("hand.json"), std::string::npos) << recording.error().message;
  EXPECT_NE(recording.error().message.find(GetParam().says), std::string::npos) << recording.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    Files, AFrameRefusal,
    testing::Values(
        BadJson{"Empty", "", "is empty"}, BadJson{"Text", "t,px,py", "is no complete JSON"},
        BadJson{"ExtraText", file_of(pose(0) + "," + pose(1)) + "x", "is no complete JSON"},
        BadJson{"NotANumberLiteral", file_of(R"({"position":{"x":NaN}})"), "is no complete JSON"},
        BadJson{"Overflow", file_of(pose(0, R"({"x":1e999,"y":0,"z":0})")), "is no complete JSON"},
        BadJson{"Array", "[1]", "is an array; an A-Frame recording is an object"},
        BadJson{"Number", "17", "is 17; an A-Frame recording is an object"},
        BadJson{"NoTracks", "{}", "holds no track"}, BadJson{"NoPoses", R"({"rhand":{"events":[]}})", "holds no track"},
        BadJson{"PosesNoArray", R"({"rhand":{"poses":{}}})", "rhand.poses is an object; it must be an array"},
        BadJson{"NoSamples", file_of(""), "holds 0 samples; a recording needs at least 2"},
        BadJson{"OneSample", file_of(pose(0)), "holds 1 sample; a recording needs at least 2"},
        BadJson{"PoseNoObject", file_of(pose(0) + ",7"), "rhand.poses[1] is 7; it must be an object"},
        BadJson{"NoPosition", file_of(R"({"rotation":{},"timestamp":1})"), "rhand.poses[0].position is missing"},
        BadJson{"PositionArray", file_of(pose(0, "[0,0,0]")),
                "rhand.poses[0].position is an array; it must be an object"},
        BadJson{"NoAxis", file_of(pose(0, R"({"x":0,"y":0})")), "rhand.poses[0].position: key \"z\" is missing"},
        BadJson{"Null", file_of(pose(0, R"({"x":0,"y":null,"z":0})")),
                "rhand.poses[0].position.y is null; it must be a finite number"},
        BadJson{"String", file_of(pose(0, R"({"x":0,"y":0,"z":0})", R"({"x":"1","y":0,"z":0})")),
                "rhand.poses[0].rotation.x is \"1\"; it must be a finite number"},
        BadJson{"NoTimestamp", file_of(R"({"position":{"x":0,"y":0,"z":0},"rotation":{"x":0,"y":0,"z":0}})"),
                "rhand.poses[0]: key \"timestamp\" is missing"},
        BadJson{"Backwards", file_of(pose(10) + "," + pose(9)), "rhand.poses[1]: time goes backwards"},
        BadJson{"Repeats", file_of(pose(10) + "," + pose(10)), "rhand.poses[1]: time 0.01 s repeats"},
        BadJson{"Millimetres", file_of(pose(0, R"({"x":0,"y":1200,"z":0})")),
                "rhand.poses[0]: position [0, 0, 1200] m is 1200 m from the origin"}),
    [](const auto& bad) { return bad.param.name; });

// Cut anywhere, the file is refused; it never crashes, hangs or half loads.
TEST(AFrame, RefusesTruncatedFiles) {
  std::ifstream stream(kExamples / "physics/demo-recording.json", std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  ASSERT_GT(text.size(), 100000u);
  std::mt19937 random(3);
  for (int i = 0; i < 50; ++i) {
    const std::size_t length = i == 0 ? text.find_last_of('}') : 1 + random() % (i < 40 ? 20000 : text.size() - 100);
    const auto recording = load_json(text.substr(0, length));
    ASSERT_FALSE(recording) << length;
    EXPECT_NE(recording.error().message.find("is no complete JSON"), std::string::npos) << recording.error().message;
  }
}

}  // namespace
}  // namespace steadyhand
