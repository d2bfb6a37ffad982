#include "steadyhand/cameras/video/video_encoder.hpp"

#include <fmt/format.h>

#include <cmath>

#include "steadyhand/cameras/video/ffmpeg.hpp"

namespace steadyhand {

namespace {

class H264Encoder final : public VideoEncoder {
 public:
  H264Encoder(const CameraInfo& camera, Ffmpeg<AVCodecContext> context, Ffmpeg<AVFrame> frame,
              Ffmpeg<SwsContext> scaler)
      : camera_(camera),
        context_(std::move(context)),
        frame_(std::move(frame)),
        packet_(ffmpeg().av_packet_alloc()),
        scaler_(std::move(scaler)) {}

  Result<VideoPacket> encode(const Picture& picture) override {
    if (int code = ffmpeg().av_frame_make_writable(frame_.get()); code < 0) return failed(code);
    const std::uint8_t* rows[] = {picture.rgb.data()};
    const int bytes[] = {3 * camera_.width};
    ffmpeg().sws_scale(scaler_.get(), rows, bytes, 0, camera_.height, frame_->data, frame_->linesize);
    frame_->pts = next_++;
    if (int code = ffmpeg().avcodec_send_frame(context_.get(), frame_.get()); code < 0) return failed(code);
    if (int code = ffmpeg().avcodec_receive_packet(context_.get(), packet_.get()); code < 0) return failed(code);
    VideoPacket made;
    made.camera = picture.camera;
    made.stamp.hand = picture.exposed;
    made.is_key = (packet_->flags & AV_PKT_FLAG_KEY) != 0;
    made.data.assign(reinterpret_cast<const char*>(packet_->data), static_cast<std::size_t>(packet_->size));
    ffmpeg().av_packet_unref(packet_.get());
    return made;
  }

 private:
  static Error failed(int code) { return Error{"libx264: " + ffmpeg_reason(code)}; }

  CameraInfo camera_;
  Ffmpeg<AVCodecContext> context_;
  Ffmpeg<AVFrame> frame_;
  Ffmpeg<AVPacket> packet_;
  Ffmpeg<SwsContext> scaler_;
  std::int64_t next_ = 0;
};

}  // namespace

Result<std::unique_ptr<VideoEncoder>> make_h264_encoder(const CameraInfo& camera) {
  if (camera.width < 2 || camera.height < 2 || camera.width % 2 != 0 || camera.height % 2 != 0) {
    return Error{fmt::format("camera '{}' has {} x {} pixels; both must be even, from 2 on", camera.name, camera.width,
                             camera.height)};
  }
  if (Status s = load_ffmpeg(); !s) return s.error();
  const AVCodec* codec = ffmpeg().avcodec_find_encoder_by_name("libx264");
  if (codec == nullptr) return Error{"this libavcodec was built without libx264, which cameras are encoded with"};
  Ffmpeg<AVCodecContext> context(ffmpeg().avcodec_alloc_context3(codec));
  context->width = camera.width;
  context->height = camera.height;
  context->pix_fmt = AV_PIX_FMT_YUV420P;
  context->time_base = ffmpeg().av_d2q(1.0 / camera.rate_hz, 1'000'000);
  context->gop_size = std::max(1, static_cast<int>(std::lround(camera.rate_hz)));
  context->max_b_frames = 0;
  context->thread_count = 1;  // the control loop needs the processors
  ffmpeg().av_opt_set(context->priv_data, "preset", "veryfast", 0);
  ffmpeg().av_opt_set(context->priv_data, "tune", "zerolatency", 0);
  ffmpeg().av_opt_set(context->priv_data, "crf", "23", 0);
  ffmpeg().av_opt_set(context->priv_data, "x264-params", "scenecut=0", 0);  // key pictures only at fixed times
  if (const int code = ffmpeg().avcodec_open2(context.get(), codec, nullptr); code < 0) {
    return Error{fmt::format("camera '{}': libx264: {}", camera.name, ffmpeg_reason(code))};
  }
  Ffmpeg<AVFrame> frame(ffmpeg().av_frame_alloc());
  frame->format = AV_PIX_FMT_YUV420P;
  frame->width = camera.width;
  frame->height = camera.height;
  if (const int code = ffmpeg().av_frame_get_buffer(frame.get(), 0); code < 0) {
    return Error{fmt::format("camera '{}': {}", camera.name, ffmpeg_reason(code))};
  }
  Ffmpeg<SwsContext> scaler(ffmpeg().sws_getCachedContext(nullptr, camera.width, camera.height, AV_PIX_FMT_RGB24,
                                                          camera.width, camera.height, AV_PIX_FMT_YUV420P, SWS_BILINEAR,
                                                          nullptr, nullptr, nullptr));
  return std::unique_ptr<VideoEncoder>(
      new H264Encoder(camera, std::move(context), std::move(frame), std::move(scaler)));
}

}  // namespace steadyhand
