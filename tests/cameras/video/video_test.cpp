#include <gtest/gtest.h>

#include <algorithm>

#include "steadyhand/cameras/video/ffmpeg.hpp"
#include "steadyhand/cameras/video/file_source.hpp"
#include "steadyhand/cameras/video/video_encoder.hpp"
#include "support/manual_clock.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

constexpr int kWidth = 64, kHeight = 48;

/// A bright bar at x = 4 k before black.
Picture bar(int k) {
  Picture picture;
  picture.exposed = from_seconds(0.1 * k);
  picture.rgb.assign(3 * kWidth * kHeight, 0);
  for (int y = 0; y < kHeight; ++y) std::fill_n(picture.rgb.begin() + 3 * (kWidth * y + 4 * k), 3 * 4, 255);
  return picture;
}

TEST(H264Encoder, EachPictureComesBackAtOnceAndAsItWas) {
  const auto encoder = make_h264_encoder({"front", kWidth, kHeight, 5.0});
  ASSERT_TRUE(encoder) << encoder.error().message;
  const AVCodec* codec = ffmpeg().avcodec_find_decoder(AV_CODEC_ID_H264);
  const Ffmpeg<AVCodecContext> decoder(ffmpeg().avcodec_alloc_context3(codec));
  decoder->flags |= AV_CODEC_FLAG_LOW_DELAY;
  ASSERT_EQ(ffmpeg().avcodec_open2(decoder.get(), codec, nullptr), 0);
  const Ffmpeg<AVPacket> packet(ffmpeg().av_packet_alloc());
  const Ffmpeg<AVFrame> frame(ffmpeg().av_frame_alloc());
  for (int k = 0; k < 12; ++k) {
    Result<VideoPacket> made = (*encoder)->encode(bar(k));
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(made->stamp.hand, from_seconds(0.1 * k));
    EXPECT_EQ(made->is_key, k % 5 == 0);                             // one a second
    EXPECT_EQ(made->data.substr(0, 4), std::string("\0\0\0\1", 4));  // Annex B
    packet->data = reinterpret_cast<std::uint8_t*>(made->data.data());
    packet->size = static_cast<int>(made->data.size());
    ASSERT_EQ(ffmpeg().avcodec_send_packet(decoder.get(), packet.get()), 0);
    ASSERT_EQ(ffmpeg().avcodec_receive_frame(decoder.get(), frame.get()), 0) << "picture " << k << " waits for others";
    const std::uint8_t* row = frame->data[0] + 24 * frame->linesize[0];
    EXPECT_EQ((std::max_element(row, row + kWidth) - row) / 4, k);
    EXPECT_GT(row[4 * k + 1], 200);
  }
}

TEST(H264Encoder, RefusesOddSizes) {
  const auto encoder = make_h264_encoder({"front", 63, 48, 5.0});
  ASSERT_FALSE(encoder);
  EXPECT_EQ(encoder.error().message, "camera 'front' has 63 x 48 pixels; both must be even, from 2 on");
}

/// Grey pictures, 10 a second, each darker by 20 than the one before.
std::string y4m(int pictures) {
  std::string file = "YUV4MPEG2 W64 H48 F10:1 Ip A1:1 C420jpeg\n";
  for (int k = 0; k < pictures; ++k) {
    file += "FRAME\n" + std::string(kWidth * kHeight, static_cast<char>(220 - 20 * k)) +
            std::string(kWidth * kHeight / 2, '\x80');
  }
  return file;
}

TEST(FileSource, PlaysInTimeAndIsUnpluggedAtItsEnd) {
  const TemporaryFolder folder;
  ManualClock clock;
  const auto source = open_file_source(folder.write("six.y4m", y4m(6)), {"front", 32, 24, 10.0}, clock);
  ASSERT_TRUE(source) << source.error().message;
  Picture picture;
  const Time begin = clock.now();
  int before = 256;
  for (int k = 0; k < 6; ++k) {
    Result<bool> taken = (*source)->take(picture);
    while (taken && !*taken) taken = (*source)->take(picture);
    ASSERT_TRUE(taken) << taken.error().message;
    EXPECT_EQ(picture.exposed - begin, from_seconds(0.1 * k));
    EXPECT_GE(clock.now(), picture.exposed);  // none from the future
    ASSERT_EQ(picture.rgb.size(), 3U * 32 * 24);
    EXPECT_LT(picture.rgb[0], before);
    before = picture.rgb[0];
  }
  const Result<bool> after = (*source)->take(picture);
  ASSERT_FALSE(after);
  EXPECT_NE(after.error().message.find("six.y4m: the video ended"), std::string::npos) << after.error().message;
}

TEST(FileSource, LeavesOutWhatIsFasterThanTheCamera) {
  const TemporaryFolder folder;
  ManualClock clock;
  const auto source = open_file_source(folder.write("ten.y4m", y4m(10)), {"front", 32, 24, 5.0}, clock);
  ASSERT_TRUE(source) << source.error().message;
  Picture picture;
  int pictures = 0;
  for (Result<bool> taken = true; (taken = (*source)->take(picture));) pictures += *taken ? 1 : 0;
  EXPECT_EQ(pictures, 5);
}

TEST(FileSource, LeavesOutWhatIsOverWhereItIsBehind) {
  const TemporaryFolder folder;
  ManualClock clock;
  const auto source = open_file_source(folder.write("ten.y4m", y4m(10)), {"front", 32, 24, 10.0}, clock);
  ASSERT_TRUE(source) << source.error().message;
  Picture picture;
  ASSERT_TRUE((*source)->take(picture));
  const Time begin = picture.exposed;
  clock.advance(0.45);  // the consumer was busy
  const Result<bool> taken = (*source)->take(picture);
  ASSERT_TRUE(taken && *taken);
  EXPECT_EQ(picture.exposed - begin, from_seconds(0.4));
  EXPECT_EQ(picture.left_out, 3);
  EXPECT_LE(clock.now() - picture.exposed, from_seconds(0.1));
}

TEST(FileSource, RefusesWhatIsNoVideo) {
  const TemporaryFolder folder;
  ManualClock clock;
  const auto refusal = [&](const std::string& path) {
    const auto source = open_file_source(path, {"front", 32, 24, 10.0}, clock);
    return source ? std::string() : source.error().message;
  };
  EXPECT_NE(refusal(folder.path() / "none.mp4").find("none.mp4: No such file"), std::string::npos);
  EXPECT_NE(refusal(folder.write("text.mp4", "words, and no video")).find("text.mp4: "), std::string::npos);
  EXPECT_NE(refusal(folder.write("empty.mp4", "")).find("empty.mp4: "), std::string::npos);
  EXPECT_NE(refusal(folder.path()), "");
}

}  // namespace
}  // namespace steadyhand
