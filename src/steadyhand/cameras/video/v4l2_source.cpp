#include "steadyhand/cameras/video/v4l2_source.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "steadyhand/cameras/video/ffmpeg.hpp"

namespace steadyhand {

namespace {

constexpr Time kLongestWait = std::chrono::milliseconds(100);  ///< longest wait in take()
constexpr std::uint32_t kBuffers = 4;
constexpr unsigned kMajor = 81;  ///< of Video4Linux devices

/// A format that the source can read; the cheapest come first.
struct Format {
  std::uint32_t v4l2;
  AVPixelFormat pixels;  ///< none: MJPEG
};
constexpr Format kFormats[] = {{V4L2_PIX_FMT_YUYV, AV_PIX_FMT_YUYV422}, {V4L2_PIX_FMT_UYVY, AV_PIX_FMT_UYVY422},
                               {V4L2_PIX_FMT_RGB24, AV_PIX_FMT_RGB24},  {V4L2_PIX_FMT_BGR24, AV_PIX_FMT_BGR24},
                               {V4L2_PIX_FMT_GREY, AV_PIX_FMT_GRAY8},   {V4L2_PIX_FMT_MJPEG, AV_PIX_FMT_NONE},
                               {V4L2_PIX_FMT_JPEG, AV_PIX_FMT_NONE}};

class KernelsDevice final : public V4l2Device {
 public:
  explicit KernelsDevice(int file) : file_(file) {}
  ~KernelsDevice() override {
    for (const auto& [memory, bytes] : mapped_) munmap(memory, bytes);
    ::close(file_);
  }

  int control(unsigned long request, void* argument) override {
    while (ioctl(file_, request, argument) != 0) {
      if (errno != EINTR) return errno;
    }
    return 0;
  }

  const std::uint8_t* map(std::size_t bytes, std::int64_t offset) override {
    void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_, offset);
    if (memory == MAP_FAILED) return nullptr;
    mapped_.emplace_back(memory, bytes);
    return static_cast<const std::uint8_t*>(memory);
  }

  int wait(Time most) override {
    pollfd waits{file_, POLLIN, 0};
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(most).count();
    const int found = poll(&waits, 1, static_cast<int>(ms));
    if (found < 0) return errno == EINTR ? EAGAIN : errno;
    if ((waits.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return ENODEV;
    return found > 0 ? 0 : EAGAIN;
  }

 private:
  int file_;
  std::vector<std::pair<void*, std::size_t>> mapped_;
};

class V4l2Source final : public PictureSource {
 public:
  V4l2Source(std::string path, std::unique_ptr<V4l2Device> device, const CameraInfo& camera, Clock& clock)
      : path_(std::move(path)), device_(std::move(device)), cameras_{camera}, clock_(&clock) {}
  ~V4l2Source() override {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    (void)device_->control(VIDIOC_STREAMOFF, &type);
  }

  const std::vector<CameraInfo>& cameras() const override { return cameras_; }

  Status begin() {
    v4l2_capability has{};
    if (device_->control(VIDIOC_QUERYCAP, &has) != 0) return refuse("is no camera that Video4Linux2 knows");
    const std::uint32_t can = (has.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? has.device_caps : has.capabilities;
    if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
      return refuse(
          "gives no pictures; a camera often has several devices, of which one does (v4l2-ctl --list-devices)");
    }
    if (Status s = choose(); !s) return s;
    if (format_.pixels == AV_PIX_FMT_NONE) {
      const AVCodec* codec = ffmpeg().avcodec_find_decoder(AV_CODEC_ID_MJPEG);
      if (codec == nullptr) return refuse("gives MJPEG, which this libavcodec cannot decode");
      decoder_.reset(ffmpeg().avcodec_alloc_context3(codec));
      decoder_->thread_count = 1;
      if (const int code = ffmpeg().avcodec_open2(decoder_.get(), codec, nullptr); code < 0)
        return refuse(ffmpeg_reason(code));
      frame_.reset(ffmpeg().av_frame_alloc());
      packet_.reset(ffmpeg().av_packet_alloc());
    }
    return map_buffers();
  }

  Result<bool> take(Picture& picture) override {
    if (const int code = device_->wait(kLongestWait); code == EAGAIN)
      return false;
    else if (code != 0)
      return ended(code);
    std::optional<v4l2_buffer> newest;
    while (true) {  // if several wait, take the last
      v4l2_buffer buffer = of_kind(0);
      const int code = device_->control(VIDIOC_DQBUF, &buffer);
      if (code == EAGAIN) break;
      if (code != 0) return ended(code);
      if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || buffer.index >= memory_.size() || is_early(buffer)) {
        if (const int failed = give_back(buffer)) return ended(failed);
        continue;
      }
      last_ = stamp_of(buffer);
      if (newest) {
        ++left_out_;
        if (const int failed = give_back(*newest)) return ended(failed);
      }
      newest = buffer;
    }
    if (!newest) return false;
    const bool is_whole = read(*newest, picture);
    if (const int code = give_back(*newest)) return ended(code);
    if (!is_whole) {
      ++left_out_;
      return false;
    }
    picture.camera = 0;
    picture.exposed = *last_;
    picture.left_out = std::exchange(left_out_, 0);
    return true;
  }

 private:
  Error refuse(const std::string& why) const { return Error{fmt::format("{}: {}", path_, why)}; }
  Error ended(int code) const {
    return refuse(code == ENODEV ? "the camera was unplugged" : std::string(std::strerror(code)));
  }

  static v4l2_buffer of_kind(std::uint32_t index) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    return buffer;
  }
  int give_back(v4l2_buffer buffer) { return device_->control(VIDIOC_QBUF, &buffer); }

  /// The first format that reaches the wanted rate, otherwise the fastest.
  Status choose() {
    double fastest = 0.0;
    for (const Format& format : kFormats) {
      if (!offers(format.v4l2)) continue;
      double rate = 0.0;
      if (const int code = set(format, rate); code == EBUSY)
        return refuse("another program uses it");
      else if (code != 0)
        continue;
      if (rate > fastest) {
        fastest = rate;
        format_ = format;
      }
      if (rate >= 0.95 * cameras_[0].rate_hz) return Done{};
    }
    double rate = 0.0;
    if (fastest > 0.0 && set(format_, rate) == 0) return Done{};
    return refuse("gives neither YUYV, UYVY, RGB, grey nor MJPEG pictures");
  }

  bool offers(std::uint32_t format) {
    v4l2_fmtdesc each{};
    each.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    for (; device_->control(VIDIOC_ENUM_FMT, &each) == 0; ++each.index) {
      if (each.pixelformat == format) return true;
    }
    return false;
  }

  /// @param rate Hz, output: the rate that the device reports, otherwise the wanted rate
  int set(const Format& format, double& rate) {
    v4l2_format wanted{};
    wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    wanted.fmt.pix.width = static_cast<std::uint32_t>(cameras_[0].width);
    wanted.fmt.pix.height = static_cast<std::uint32_t>(cameras_[0].height);
    wanted.fmt.pix.pixelformat = format.v4l2;
    wanted.fmt.pix.field = V4L2_FIELD_NONE;
    if (const int code = device_->control(VIDIOC_S_FMT, &wanted)) return code;
    if (wanted.fmt.pix.pixelformat != format.v4l2) return EINVAL;
    size_ = wanted.fmt.pix;
    v4l2_streamparm timing{};
    timing.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    timing.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(1000.0 * cameras_[0].rate_hz)};
    rate = cameras_[0].rate_hz;
    const v4l2_fract& period = timing.parm.capture.timeperframe;
    if (device_->control(VIDIOC_S_PARM, &timing) == 0 && period.numerator > 0) {
      rate = static_cast<double>(period.denominator) / period.numerator;
    }
    return 0;
  }

  Status map_buffers() {
    v4l2_requestbuffers wanted{};
    wanted.count = kBuffers;
    wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    wanted.memory = V4L2_MEMORY_MMAP;
    if (const int code = device_->control(VIDIOC_REQBUFS, &wanted)) {
      return refuse(code == EBUSY ? "another program uses it" : std::strerror(code));
    }
    for (std::uint32_t i = 0; i < wanted.count; ++i) {
      v4l2_buffer buffer = of_kind(i);
      if (const int code = device_->control(VIDIOC_QUERYBUF, &buffer)) return refuse(std::strerror(code));
      const std::uint8_t* memory = device_->map(buffer.length, buffer.m.offset);
      if (memory == nullptr) return refuse("its memory cannot be mapped");
      memory_.emplace_back(memory, buffer.length);
      if (const int code = give_back(buffer)) return refuse(std::strerror(code));
    }
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (const int code = device_->control(VIDIOC_STREAMON, &type)) {
      return refuse(code == EBUSY ? "another program uses it" : std::strerror(code));
    }
    return Done{};
  }

  Time stamp_of(const v4l2_buffer& buffer) const {
    const Time now = clock_->now();
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) return now;
    return std::min(
        now, Time(std::chrono::seconds(buffer.timestamp.tv_sec)) + std::chrono::microseconds(buffer.timestamp.tv_usec));
  }

  /// True if the camera is faster than wanted and this picture comes too soon.
  bool is_early(const v4l2_buffer& buffer) const {
    return last_ && stamp_of(buffer) < *last_ + from_seconds(0.75 / cameras_[0].rate_hz);
  }

  /// False: the picture is incomplete.
  bool read(const v4l2_buffer& buffer, Picture& picture) {
    const auto& [memory, length] = memory_[buffer.index];
    const std::size_t bytes = std::min<std::size_t>(buffer.bytesused, length);
    if (format_.pixels == AV_PIX_FMT_NONE) return decode(memory, bytes, picture);
    const std::uint8_t* rows[] = {memory};
    const int stride[] = {static_cast<int>(size_.bytesperline)};
    if (bytes < static_cast<std::size_t>(size_.bytesperline) * size_.height) return false;
    return scale(rows, stride, static_cast<int>(size_.width), static_cast<int>(size_.height), format_.pixels, picture);
  }

  bool decode(const std::uint8_t* memory, std::size_t bytes, Picture& picture) {
    if (ffmpeg().av_new_packet(packet_.get(), static_cast<int>(bytes)) < 0)
      return false;  // with the padding that decoders need
    std::memcpy(packet_->data, memory, bytes);
    const int sent = ffmpeg().avcodec_send_packet(decoder_.get(), packet_.get());
    ffmpeg().av_packet_unref(packet_.get());
    if (sent < 0 || ffmpeg().avcodec_receive_frame(decoder_.get(), frame_.get()) < 0) return false;
    return scale(frame_->data, frame_->linesize, frame_->width, frame_->height,
                 static_cast<AVPixelFormat>(frame_->format), picture);
  }

  bool scale(const std::uint8_t* const* from, const int* stride, int width, int height, AVPixelFormat pixels,
             Picture& picture) {
    const CameraInfo& camera = cameras_[0];
    scaler_.reset(ffmpeg().sws_getCachedContext(scaler_.release(), width, height, pixels, camera.width, camera.height,
                                                AV_PIX_FMT_RGB24, SWS_BILINEAR, nullptr, nullptr, nullptr));
    if (!scaler_) return false;
    picture.rgb.resize(static_cast<std::size_t>(3) * camera.width * camera.height);
    std::uint8_t* rows[] = {picture.rgb.data()};
    const int bytes[] = {3 * camera.width};
    ffmpeg().sws_scale(scaler_.get(), from, stride, 0, height, rows, bytes);
    return true;
  }

  std::string path_;
  std::unique_ptr<V4l2Device> device_;
  std::vector<CameraInfo> cameras_;
  Clock* clock_;
  Format format_ = kFormats[0];
  v4l2_pix_format size_{};
  std::vector<std::pair<const std::uint8_t*, std::size_t>> memory_;  ///< one for each buffer
  std::optional<Time> last_;                                         ///< exposure of the last picture taken
  int left_out_ = 0;  ///< pictures, since the last one that was passed on
  Ffmpeg<AVCodecContext> decoder_;
  Ffmpeg<AVFrame> frame_;
  Ffmpeg<AVPacket> packet_;
  Ffmpeg<SwsContext> scaler_;
};

}  // namespace

Result<std::unique_ptr<V4l2Device>> open_v4l2_device(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) return Error{fmt::format("{}: {}", path, std::strerror(errno))};
  // Opening another kind of device can have side effects, for example start a watchdog.
  if (!S_ISCHR(about.st_mode) || major(about.st_rdev) != kMajor) {
    return Error{fmt::format("{}: is no camera that Video4Linux2 knows", path)};
  }
  const int file = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file >= 0) return std::unique_ptr<V4l2Device>(new KernelsDevice(file));
  const int code = errno;
  const char* more = code == EACCES  ? "; who is in the group 'video' may use cameras"
                     : code == EBUSY ? "; another program uses it"
                                     : "";
  return Error{fmt::format("{}: {}{}", path, std::strerror(code), more)};
}

Result<std::unique_ptr<PictureSource>> make_v4l2_source(const std::string& path, std::unique_ptr<V4l2Device> device,
                                                        const CameraInfo& camera, Clock& clock) {
  if (Status s = load_ffmpeg(); !s) return s.error();
  auto source = std::make_unique<V4l2Source>(path, std::move(device), camera, clock);
  if (Status s = source->begin(); !s) return s.error();
  return std::unique_ptr<PictureSource>(std::move(source));
}

}  // namespace steadyhand
