#include "steadyhand/cameras/video/file_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "steadyhand/cameras/video/ffmpeg.hpp"

namespace steadyhand {

namespace {

constexpr Time kMostPatience = std::chrono::milliseconds(100);  ///< longest wait in take()

class FileSource final : public PictureSource {
 public:
  FileSource(std::string path, const CameraInfo& camera, Clock& clock, Ffmpeg<AVFormatContext> file, int stream,
             Ffmpeg<AVCodecContext> decoder)
      : path_(std::move(path)),
        cameras_{camera},
        clock_(&clock),
        file_(std::move(file)),
        stream_(stream),
        decoder_(std::move(decoder)),
        frame_(ffmpeg().av_frame_alloc()),
        packet_(ffmpeg().av_packet_alloc()),
        last_(-1.0 / camera.rate_hz) {}

  const std::vector<CameraInfo>& cameras() const override { return cameras_; }

  Result<bool> take(Picture& picture) override {
    if (!due_) {
      if (Status s = next(); !s) return s.error();
    }
    const Time now = clock_->now();
    if (!begin_) begin_ = now - *due_;
    // A late reader skips past pictures: otherwise the delay would grow.
    for (const Time period = from_seconds(1.0 / cameras_[0].rate_hz); *begin_ + *due_ + period < now; ++left_out_) {
      if (Status s = next(); !s) return s.error();
    }
    const Time at = *begin_ + *due_;
    if (at > now + kMostPatience) {
      clock_->sleep_until(now + kMostPatience);
      return false;
    }
    clock_->sleep_until(at);
    if (Status s = scale(picture); !s) return s.error();
    picture.camera = 0;
    picture.exposed = at;
    picture.left_out = std::exchange(left_out_, 0);
    due_.reset();
    return true;
  }

 private:
  Error ended(const std::string& why) const { return Error{fmt::format("{}: {}", path_, why)}; }

  /// Decodes the next picture that fits the camera's rate.
  Status next() {
    const double period = 1.0 / cameras_[0].rate_hz;
    const AVRational unit = file_->streams[stream_]->time_base;
    while (true) {
      int code = ffmpeg().avcodec_receive_frame(decoder_.get(), frame_.get());
      if (code == 0) {
        const std::int64_t pts = frame_->best_effort_timestamp;
        const double t = pts == AV_NOPTS_VALUE ? last_ + period : static_cast<double>(pts) * av_q2d(unit);
        if (t < last_ + 0.75 * period) continue;
        last_ = t;
        due_ = from_seconds(t);
        return Done{};
      }
      if (code == AVERROR_EOF) return ended("the video ended");
      if (code != AVERROR(EAGAIN)) return ended(ffmpeg_reason(code));
      code = ffmpeg().av_read_frame(file_.get(), packet_.get());
      if (code == AVERROR_EOF) {
        code = ffmpeg().avcodec_send_packet(decoder_.get(), nullptr);
      } else if (code >= 0) {
        code = packet_->stream_index == stream_ ? ffmpeg().avcodec_send_packet(decoder_.get(), packet_.get()) : 0;
        ffmpeg().av_packet_unref(packet_.get());
        if (code == AVERROR_INVALIDDATA) code = 0;  // a damaged picture; the next may be intact
      }
      if (code < 0 && code != AVERROR_EOF) return ended(ffmpeg_reason(code));
    }
  }

  Status scale(Picture& picture) {
    const CameraInfo& camera = cameras_[0];
    scaler_.reset(ffmpeg().sws_getCachedContext(scaler_.release(), frame_->width, frame_->height,
                                                static_cast<AVPixelFormat>(frame_->format), camera.width, camera.height,
                                                AV_PIX_FMT_RGB24, SWS_BILINEAR, nullptr, nullptr, nullptr));
    if (!scaler_) return ended("its pictures cannot be scaled");
    picture.rgb.resize(static_cast<std::size_t>(3) * camera.width * camera.height);
    std::uint8_t* rows[] = {picture.rgb.data()};
    const int bytes[] = {3 * camera.width};
    ffmpeg().sws_scale(scaler_.get(), frame_->data, frame_->linesize, 0, frame_->height, rows, bytes);
    return Done{};
  }

  std::string path_;
  std::vector<CameraInfo> cameras_;
  Clock* clock_;
  Ffmpeg<AVFormatContext> file_;
  int stream_;
  Ffmpeg<AVCodecContext> decoder_;
  Ffmpeg<AVFrame> frame_;
  Ffmpeg<AVPacket> packet_;
  Ffmpeg<SwsContext> scaler_;
  double last_;                ///< s, in the file's time: of the last picture taken
  std::optional<Time> begin_;  ///< where the file's time begins, session's clock
  int left_out_ = 0;           ///< pictures, since the last one taken
  std::optional<Time> due_;    ///< time of frame_, in the file's time; none: it was taken
};

}  // namespace

Result<std::unique_ptr<PictureSource>> open_file_source(const std::string& path, const CameraInfo& camera,
                                                        Clock& clock) {
  if (Status s = load_ffmpeg(); !s) return s.error();
  const auto refuse = [&](const std::string& why) { return Error{fmt::format("{}: {}", path, why)}; };
  AVFormatContext* opened = nullptr;
  if (const int code = ffmpeg().avformat_open_input(&opened, ("file:" + path).c_str(), nullptr, nullptr); code < 0) {
    return refuse(ffmpeg_reason(code));
  }
  Ffmpeg<AVFormatContext> file(opened);
  if (const int code = ffmpeg().avformat_find_stream_info(file.get(), nullptr); code < 0)
    return refuse(ffmpeg_reason(code));
  const AVCodec* codec = nullptr;
  const int stream = ffmpeg().av_find_best_stream(file.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
  if (stream < 0 || codec == nullptr) return refuse("has no video that FFmpeg's libraries can decode");
  Ffmpeg<AVCodecContext> decoder(ffmpeg().avcodec_alloc_context3(codec));
  decoder->thread_count = 1;
  int code = ffmpeg().avcodec_parameters_to_context(decoder.get(), file->streams[stream]->codecpar);
  if (code >= 0) code = ffmpeg().avcodec_open2(decoder.get(), codec, nullptr);
  if (code < 0) return refuse(ffmpeg_reason(code));
  return std::unique_ptr<PictureSource>(
      new FileSource(path, camera, clock, std::move(file), stream, std::move(decoder)));
}

}  // namespace steadyhand
