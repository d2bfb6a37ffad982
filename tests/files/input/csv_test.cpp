#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "steadyhand/files/input/recording.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

const std::string kHeader = "t,px,py,pz,qx,qy,qz,qw\n";

Result<Recording> load_csv(const std::string& content, const RecordingOptions& options = {}) {
  const TemporaryFolder folder;
  return load_recording(folder.write("hand.csv", content), options);
}

TEST(Csv, ReturnsWhatWasWritten) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::string content = "t,px,py,pz,qx,qy,qz,qw,clutch\n";
  std::vector<OperatorSample> written;
  double t = 1.7e9;  // since an epoch
  for (int i = 0; i < 1000; ++i) {
    t += 0.006 + 0.005 * unit(random);
    OperatorSample sample;
    sample.stamp.hand = from_seconds(t);
    sample.X_operator_hand.p = Vector3(unit(random), unit(random), unit(random));
    sample.X_operator_hand.q = Quaternion(unit(random), unit(random), unit(random), unit(random)).normalized();
    sample.clutch = unit(random) > 0.0;
    written.push_back(sample);
    const auto& [p, q] = sample.X_operator_hand;
    content += fmt::format("{},{},{},{},{},{},{},{},{}\n", t, p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w(),
                           sample.clutch ? 1 : 0);
  }
  const auto recording = load_csv(content);
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->samples.size(), written.size());
  EXPECT_TRUE(recording->track.empty());
  for (std::size_t i = 0; i < written.size(); ++i) {
    const OperatorSample& read = recording->samples[i];
    const double elapsed = to_seconds(written[i].stamp.hand - written[0].stamp.hand);
    EXPECT_NEAR(to_seconds(read.stamp.hand), elapsed, 1e-6);  // a double holds 2e-7 s at 1.7e9 s
    EXPECT_EQ(read.stamp.made, read.stamp.hand);
    EXPECT_EQ(read.X_operator_hand.p, written[i].X_operator_hand.p);
    EXPECT_TRUE(read.X_operator_hand.q.isApprox(written[i].X_operator_hand.q, 1e-15));
    EXPECT_EQ(read.clutch, written[i].clutch);
    EXPECT_TRUE(read.tracked);
  }
  EXPECT_NEAR(recording->mean_rate() * recording->duration(), 999.0, 1e-9);
}

TEST(Csv, EngagesThroughoutWithoutClutchColumn) {
  const auto recording = load_csv(kHeader + "0,0,0,0,0,0,0,1\n0.01,0,0,0,0,0,0,1\n");
  ASSERT_TRUE(recording) << recording.error().message;
  for (const OperatorSample& sample : recording->samples) EXPECT_TRUE(sample.clutch);
}

TEST(Csv, TakesColumnsInAnyOrderAndTextOfOtherSystems) {
  const auto recording = load_csv(
      "\xEF\xBB\xBF"
      "qw, qx, qy, qz, px, py, pz, t\r\n1,0,0,0, 1, 2, 3, 5\r\n\r\n1,0,0,0, 1, 2, 4, 6");
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->samples.size(), 2u);
  EXPECT_EQ(recording->samples[1].X_operator_hand.p, Vector3(1, 2, 4));
  EXPECT_EQ(recording->samples[1].stamp.hand, from_seconds(1.0));
}

TEST(Csv, NormalisesQuaternionsThatAreNearlyUnit) {
  const auto recording = load_csv(kHeader + "0,0,0,0,0,0,0,1.0009\n1,0,0,0,0,0,0.0,0.9991\n");
  ASSERT_TRUE(recording) << recording.error().message;
  for (const OperatorSample& sample : recording->samples) EXPECT_NEAR(sample.X_operator_hand.q.norm(), 1.0, 1e-15);
}

TEST(Csv, TakesNumbersWithAPlus) {
  const auto recording = load_csv(kHeader + "+0.5,+0.1,0,-0.2,0,0,0,+1\n+1.5e0,0,0,0,0,0,0,1\n");
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->samples[0].X_operator_hand.p, Vector3(0.1, 0, -0.2));
  EXPECT_EQ(recording->samples[1].stamp.hand, from_seconds(1.0));
}

TEST(Csv, CutsARangeAndStartsItAtZero) {
  std::string content = kHeader;
  for (int i = 0; i <= 100; ++i) content += fmt::format("{},{},0,0,0,0,0,1\n", 3.0 + 0.1 * i, 0.1 * i);
  const auto recording = load_csv(content, {"", 1.95, 4.05});
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->samples.size(), 21u);
  EXPECT_EQ(recording->samples[0].stamp.hand, Time(0));
  EXPECT_NEAR(recording->samples[0].X_operator_hand.p.x(), 2.0, 1e-12);
  EXPECT_NEAR(recording->duration(), 2.0, 1e-9);
  EXPECT_NEAR(recording->mean_rate(), 10.0, 1e-9);
}

struct BadCsv {
  std::string name, content, says;  // `says`: what the message must contain
};
void PrintTo(const BadCsv& bad, std::ostream* out) { *out << bad.name; }

class CsvRefusal : public testing::TestWithParam<BadCsv> {};

TEST_P(CsvRefusal, SaysWhereAndWhy) {
  const auto recording = load_csv(GetParam().content);
  ASSERT_FALSE(recording);
  EXPECT_NE(recording.error().message.find("hand.csv"), std::string::npos) << recording.error().message;
  EXPECT_NE(recording.error().message.find(GetParam().says), std::string::npos) << recording.error().message;
}

const std::string kRow = "0,0,0,0,0,0,0,1\n";

INSTANTIATE_TEST_SUITE_P(
    Files, CsvRefusal,
    testing::Values(
        BadCsv{"Empty", "", "is empty"}, BadCsv{"Blank", " \n\r\n", "is empty"},
        BadCsv{"OnlyHeader", kHeader, "holds 0 samples; a recording needs at least 2"},
        BadCsv{"OneSample", kHeader + kRow, "holds 1 sample; a recording needs at least 2"},
        BadCsv{"NoHeader", kRow + kRow, ":1: unknown column \"0\"; the header must be t,px"},
        BadCsv{"MissingColumns", "t,px,py,pz,qx,qy\n0,0,0,0,0,0\n", ":1: missing columns qz, qw; the header must be"},
        BadCsv{"MissingColumn", "t,px,py,qx,qy,qz,qw\n", ":1: missing column pz; the header must be"},
        BadCsv{"UnknownColumn", "t,px,py,pz,qx,qy,qz,qw,grip\n", ":1: unknown column \"grip\""},
        BadCsv{"ColumnTwice", "t,t,px,py,pz,qx,qy,qz,qw\n", ":1: column \"t\" appears twice"},
        BadCsv{"TooFewValues", kHeader + kRow + "1,0,0,0,0,0,0\n", ":3: has 7 values; the header names 8 columns"},
        BadCsv{"TooManyValues", kHeader + kRow + "1,0,0,0,0,0,0,1,\n", ":3: has 9 values; the header names 8 columns"},
        BadCsv{"Text", kHeader + kRow + "1,0,up,0,0,0,0,1\n", ":3: column py is \"up\"; it must be a finite number"},
        BadCsv{"ExtraText", kHeader + kRow + "1,0,2 m,0,0,0,0,1\n", ":3: column py is \"2 m\""},
        BadCsv{"TwoSigns", kHeader + kRow + "1,0,+-2,0,0,0,0,1\n", ":3: column py is \"+-2\""},
        BadCsv{"OnlyASign", kHeader + kRow + "1,0,+,0,0,0,0,1\n", ":3: column py is \"+\""},
        BadCsv{"GitLfs", "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n",
               "hand.csv: is a Git LFS pointer, not the file itself: run `git lfs pull` in its repository"},
        BadCsv{"Utf16", std::string("\xFF\xFEt\0,\0p\0", 8), "is UTF-16 text; save it as UTF-8"},
        BadCsv{"EmptyCell", kHeader + kRow + "1,0,,0,0,0,0,1\n", ":3: column py is \"\""},
        BadCsv{"Binary", kHeader + std::string("\0\x01\xff", 3) + ",0,0,0,0,0,0,1\n", ":2: column t is"},
        BadCsv{"NotANumber", kHeader + "0,nan,0,0,0,0,0,1\n", ":2: column px is \"nan\"; it must be a finite number"},
        BadCsv{"Infinity", kHeader + "0,0,0,-inf,0,0,0,1\n", ":2: column pz is \"-inf\"; it must be a finite number"},
        BadCsv{"Overflow", kHeader + "1e999,0,0,0,0,0,0,1\n", ":2: column t is \"1e999\"; it must be a finite number"},
        BadCsv{"Backwards", kHeader + kRow + "-0.1,0,0,0,0,0,0,1\n", ":3: time goes backwards, from 0 s to -0.1 s"},
        BadCsv{"Repeats", kHeader + "1,0,0,0,0,0,0,1\n1,0,0,0,0,0,0,1\n", ":3: time 1 s repeats"},
        BadCsv{"RepeatsWithinANanosecond", kHeader + kRow + "1e-10,0,0,0,0,0,0,1\n", ":3: time 1e-10 s repeats"},
        BadCsv{"Milliseconds", kHeader + kRow + "1e6,0,0,0,0,0,0,1\n", ":3: time 1000000 s is 1000000 s after"},
        BadCsv{"Aeons", kHeader + "-1e300,0,0,0,0,0,0,1\n1e300,0,0,0,0,0,0,1\n", ":3: time 1e+300 s is"},
        BadCsv{"HalfQuaternion", kHeader + "0,0,0,0,0,0,0,0.5\n",
               ":2: quaternion [0, 0, 0, 0.5] has norm 0.5; it must be 1"},
        BadCsv{"ZeroQuaternion", kHeader + "0,0,0,0,0,0,0,0\n", "has norm 0; it must be 1"},
        BadCsv{"HugeQuaternion", kHeader + "0,0,0,0,0,0,1e300,0\n", "has norm"},
        BadCsv{"Millimetres", kHeader + "0,350,0,0,0,0,0,1\n", ":2: position [350, 0, 0] m is 350 m from the origin"},
        BadCsv{"HugePosition", kHeader + "0,1e300,0,0,0,0,0,1\n", ":2: position [1e+300, 0, 0] m"},
        BadCsv{"Clutch", "t,px,py,pz,qx,qy,qz,qw,clutch\n0,0,0,0,0,0,0,1,0.5\n",
               ":2: column clutch is 0.5; it must be 0 (released) or 1 (engaged)"}),
    [](const auto& bad) { return bad.param.name; });

TEST(RecordingRefusal, OfFilesAndOptions) {
  const TemporaryFolder folder;
  const auto file = folder.write("hand.csv", kHeader + kRow + "1,0,0,0,0,0,0,1\n2,0,0,0,0,0,0,1\n");
  const auto message = [](const Result<Recording>& result) { return result ? "loaded" : result.error().message; };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto says = [&](const std::filesystem::path& path, const RecordingOptions& options, const std::string& text) {
    const std::string said = message(load_recording(path, options));
    EXPECT_NE(said.find(text), std::string::npos) << said;
  };
  says("no/such/file.csv", {}, "no/such/file.csv: no such file");
  says(folder.path(), {}, "is no regular file");
  says("/dev/zero", {}, "is no regular file");
  says(file, {"rhand", 0.0, 1.0}, "is a CSV file and has no track \"rhand\"");
  says(file, {"", -1.0, 1.0}, "starts at -1 s; it must start at 0 s or later");
  says(file, {"", kNan, 1.0}, "starts at nan s");
  says(file, {"", 1.0, 1.0}, "ends at 1 s; it must end after its start, 1 s");
  says(file, {"", 0.0, kNan}, "ends at nan s");
  says(file, {"", 1.5, 2.5}, "1 of its samples lies from 1.5 s to 2.5 s; at least 2 must. The recording lasts 2 s");
  says(file, {"", 5.0, 6.0}, "0 of its samples lie from 5 s to 6 s");
  says(file, {}, "loaded");
}

}  // namespace
}  // namespace steadyhand
