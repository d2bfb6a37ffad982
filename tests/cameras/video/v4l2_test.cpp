#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>

#include "steadyhand/cameras/video/ffmpeg.hpp"
#include "steadyhand/cameras/video/v4l2_source.hpp"
#include "support/manual_clock.hpp"

namespace steadyhand {
namespace {

constexpr std::uint32_t kColumns = 64, kRows = 48;

/// A fake driver, as far as the source uses one: no camera was available.
struct Driver {
  std::map<std::uint32_t, std::uint32_t> rates{{V4L2_PIX_FMT_YUYV, 30}};  ///< Hz, of each format
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  int trouble = 0;          ///< errno, of taking a picture
  int refuses = 0;          ///< errno, of choosing a format
  bool says_stamps = true;  ///< by the monotonic clock
  struct Filled {
    std::string bytes;
    Time exposed;
    std::uint32_t flags = 0;
  };
  std::deque<Filled> filled;
  std::uint32_t chosen = 0;
  std::deque<std::uint32_t> empty;  ///< buffers that the driver has
  std::vector<std::vector<std::uint8_t>> memory;
  bool streams = false;
};

class FakeDevice final : public V4l2Device {
 public:
  explicit FakeDevice(Driver& driver) : driver_(&driver) {}

  int control(unsigned long request, void* argument) override {
    Driver& d = *driver_;
    switch (request) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = d.capabilities;
        return 0;
      case VIDIOC_ENUM_FMT: {
        auto& format = *static_cast<v4l2_fmtdesc*>(argument);
        if (format.index >= d.rates.size()) return EINVAL;
        format.pixelformat = std::next(d.rates.begin(), format.index)->first;
        return 0;
      }
      case VIDIOC_S_FMT: {
        if (d.refuses != 0) return d.refuses;
        auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
        d.chosen = pix.pixelformat;
        pix.width = kColumns;
        pix.height = kRows;
        pix.bytesperline = 2 * kColumns;
        return 0;
      }
      case VIDIOC_S_PARM:
        static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {1, d.rates.at(d.chosen)};
        return 0;
      case VIDIOC_REQBUFS:
        d.memory.assign(static_cast<v4l2_requestbuffers*>(argument)->count, std::vector<std::uint8_t>(20000));
        return 0;
      case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        buffer.length = 20000;
        buffer.m.offset = buffer.index;
        return 0;
      }
      case VIDIOC_QBUF:
        d.empty.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_STREAMON:
      case VIDIOC_STREAMOFF:
        d.streams = request == VIDIOC_STREAMON;
        return 0;
      case VIDIOC_DQBUF:
        return take(*static_cast<v4l2_buffer*>(argument));
      default:
        return ENOTTY;
    }
  }
  const std::uint8_t* map(std::size_t, std::int64_t offset) override {
    return driver_->memory[static_cast<std::size_t>(offset)].data();
  }
  int wait(Time) override { return driver_->filled.empty() && driver_->trouble == 0 ? EAGAIN : 0; }

 private:
  int take(v4l2_buffer& buffer) {
    Driver& d = *driver_;
    if (d.trouble != 0) return d.trouble;
    if (d.filled.empty() || d.empty.empty()) return EAGAIN;
    const Driver::Filled picture = d.filled.front();
    d.filled.pop_front();
    buffer.index = d.empty.front();
    d.empty.pop_front();
    std::copy(picture.bytes.begin(), picture.bytes.end(), d.memory[buffer.index].begin());
    buffer.bytesused = static_cast<std::uint32_t>(picture.bytes.size());
    buffer.flags = picture.flags | (d.says_stamps ? V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC : 0);
    const auto us = std::chrono::duration_cast<std::chrono::microseconds>(picture.exposed).count();
    buffer.timestamp = {us / 1'000'000, us % 1'000'000};
    return 0;
  }
  Driver* driver_;
};

/// Of one grey.
std::string yuyv(int grey) {
  std::string bytes;
  for (std::uint32_t i = 0; i < kColumns * kRows; ++i) bytes += {static_cast<char>(grey), '\x80'};
  return bytes;
}

std::string mjpeg(int grey) {
  const Ffmpeg<AVCodecContext> encoder(ffmpeg().avcodec_alloc_context3(ffmpeg().avcodec_find_encoder_by_name("mjpeg")));
  encoder->width = kColumns;
  encoder->height = kRows;
  encoder->pix_fmt = AV_PIX_FMT_YUVJ420P;
  encoder->time_base = {1, 30};
  EXPECT_EQ(ffmpeg().avcodec_open2(encoder.get(), nullptr, nullptr), 0);
  const Ffmpeg<AVFrame> frame(ffmpeg().av_frame_alloc());
  frame->format = AV_PIX_FMT_YUVJ420P;
  frame->width = kColumns;
  frame->height = kRows;
  EXPECT_EQ(ffmpeg().av_frame_get_buffer(frame.get(), 0), 0);
  for (int plane = 0; plane < 3; ++plane) {
    const int rows = static_cast<int>(kRows) / (plane == 0 ? 1 : 2);
    std::memset(frame->data[plane], plane == 0 ? grey : 128, static_cast<std::size_t>(frame->linesize[plane] * rows));
  }
  EXPECT_EQ(ffmpeg().avcodec_send_frame(encoder.get(), frame.get()), 0);
  const Ffmpeg<AVPacket> packet(ffmpeg().av_packet_alloc());
  EXPECT_EQ(ffmpeg().avcodec_receive_packet(encoder.get(), packet.get()), 0);
  return {reinterpret_cast<const char*>(packet->data), static_cast<std::size_t>(packet->size)};
}

class V4l2SourceTest : public testing::Test {
 protected:
  void open() {
    auto made = make_v4l2_source("/dev/video9", std::make_unique<FakeDevice>(driver_), {"front", 32, 24, 15.0}, clock_);
    ASSERT_TRUE(made) << made.error().message;
    source_ = *std::move(made);
  }
  std::string refusal() {
    auto made = make_v4l2_source("/dev/video9", std::make_unique<FakeDevice>(driver_), {"front", 32, 24, 15.0}, clock_);
    return made ? "" : made.error().message;
  }
  static Time at(double t) { return from_seconds(99.0 + t); }
  /// Whether there is a picture, which is then in picture_.
  bool take() {
    const Result<bool> taken = source_->take(picture_);
    EXPECT_TRUE(taken) << taken.error().message;
    return taken && *taken;
  }

  ManualClock clock_;
  Driver driver_;
  std::unique_ptr<PictureSource> source_;
  Picture picture_;
};

TEST_F(V4l2SourceTest, PicturesAreScaledAndStampedAsTheDriverSays) {
  open();
  EXPECT_FALSE(take());
  for (int k = 0; k < 10; ++k) {  // more than there are buffers
    driver_.filled.push_back({yuyv(50 + 10 * k), at(0.0667 * k)});
    ASSERT_TRUE(take());
    EXPECT_EQ(picture_.exposed, at(0.0667 * k));
    ASSERT_EQ(picture_.rgb.size(), 3U * 32 * 24);
    EXPECT_NEAR(picture_.rgb[100], (34 + 10 * k) * 255 / 219.0, 3.0);
  }
  EXPECT_TRUE(driver_.streams);
  source_.reset();
  EXPECT_FALSE(driver_.streams);
}

TEST_F(V4l2SourceTest, WithoutAStampAPictureCountsFromItsComing) {
  driver_.says_stamps = false;
  open();
  driver_.filled.push_back({yuyv(50), at(0.1)});
  ASSERT_TRUE(take());
  EXPECT_EQ(picture_.exposed, clock_.now());
}

TEST_F(V4l2SourceTest, WhoIsBehindGetsTheNewestAndAFasterCameraIsThinnedOut) {
  open();
  for (const double t : {0.0, 0.033, 0.0667, 0.1333}) driver_.filled.push_back({yuyv(50), at(t)});
  ASSERT_TRUE(take());
  EXPECT_EQ(picture_.exposed, at(0.1333));
  EXPECT_EQ(picture_.left_out, 2) << "that at 0.033 s nobody wanted";
  EXPECT_EQ(driver_.empty.size(), 4U) << "the driver has all buffers again";
}

TEST_F(V4l2SourceTest, WhatIsBrokenOrNotWholeIsLeftOut) {
  open();
  driver_.filled.push_back({yuyv(50), at(0.0), V4L2_BUF_FLAG_ERROR});
  EXPECT_FALSE(take());
  driver_.filled.push_back({yuyv(50).substr(0, 1000), at(0.0667)});
  EXPECT_FALSE(take());
  driver_.filled.push_back({yuyv(50), at(0.1333)});
  ASSERT_TRUE(take());
  EXPECT_EQ(picture_.left_out, 1);
}

TEST_F(V4l2SourceTest, TakesMjpegWhereWhatIsUncompressedIsTooSlow) {
  driver_.rates = {{V4L2_PIX_FMT_YUYV, 5}, {V4L2_PIX_FMT_MJPEG, 30}};
  open();
  EXPECT_EQ(driver_.chosen, V4L2_PIX_FMT_MJPEG);
  driver_.filled.push_back({"no JPEG", at(0.0)});
  EXPECT_FALSE(take());
  driver_.filled.push_back({mjpeg(100), at(0.0667)});
  ASSERT_TRUE(take());
  EXPECT_NEAR(picture_.rgb[100], 100, 4);
  driver_.rates[V4L2_PIX_FMT_MJPEG] = 3;
  open();
  EXPECT_EQ(driver_.chosen, V4L2_PIX_FMT_YUYV) << "the fastest, though too slow";
}

TEST_F(V4l2SourceTest, OneThatIsUnpluggedSaysSo) {
  open();
  driver_.trouble = ENODEV;
  const Result<bool> taken = source_->take(picture_);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().message, "/dev/video9: the camera was unplugged");
}

TEST_F(V4l2SourceTest, WhatCannotBeReadIsRefused) {
  driver_.refuses = EBUSY;
  EXPECT_EQ(refusal(), "/dev/video9: another program uses it");
  driver_.refuses = 0;
  driver_.rates = {{V4L2_PIX_FMT_H264, 30}};
  EXPECT_NE(refusal().find("MJPEG"), std::string::npos);
  driver_.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_NE(refusal().find("several devices"), std::string::npos);
}

TEST(V4l2Device, WhatIsNoneIsRefusedUnopened) {
  EXPECT_EQ(open_v4l2_device("/dev/null").error().message, "/dev/null: is no camera that Video4Linux2 knows");
  EXPECT_EQ(open_v4l2_device("/dev/video99").error().message, "/dev/video99: No such file or directory");
}

}  // namespace
}  // namespace steadyhand
