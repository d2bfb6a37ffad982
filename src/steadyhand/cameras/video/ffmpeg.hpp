#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/imgutils.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <memory>
#include <string>

#include "steadyhand/core/shared_library.hpp"

namespace steadyhand {

/// What is used of FFmpeg's libraries, with the names of their headers.
struct FfmpegLibraries {
  SharedLibrary format;  ///< libavformat, which loads libavcodec and libavutil
  SharedLibrary scale;   ///< libswscale
  decltype(&::av_d2q) av_d2q = format("av_d2q");
  decltype(&::av_find_best_stream) av_find_best_stream = format("av_find_best_stream");
  decltype(&::av_frame_alloc) av_frame_alloc = format("av_frame_alloc");
  decltype(&::av_frame_free) av_frame_free = format("av_frame_free");
  decltype(&::av_frame_get_buffer) av_frame_get_buffer = format("av_frame_get_buffer");
  decltype(&::av_frame_make_writable) av_frame_make_writable = format("av_frame_make_writable");
  decltype(&::av_log_set_level) av_log_set_level = format("av_log_set_level");
  decltype(&::av_new_packet) av_new_packet = format("av_new_packet");
  decltype(&::av_opt_set) av_opt_set = format("av_opt_set");
  decltype(&::av_packet_alloc) av_packet_alloc = format("av_packet_alloc");
  decltype(&::av_packet_free) av_packet_free = format("av_packet_free");
  decltype(&::av_packet_unref) av_packet_unref = format("av_packet_unref");
  decltype(&::av_read_frame) av_read_frame = format("av_read_frame");
  decltype(&::av_strerror) av_strerror = format("av_strerror");
  decltype(&::avcodec_alloc_context3) avcodec_alloc_context3 = format("avcodec_alloc_context3");
  decltype(&::avcodec_find_decoder) avcodec_find_decoder = format("avcodec_find_decoder");
  decltype(&::avcodec_find_encoder_by_name) avcodec_find_encoder_by_name = format("avcodec_find_encoder_by_name");
  decltype(&::avcodec_free_context) avcodec_free_context = format("avcodec_free_context");
  decltype(&::avcodec_open2) avcodec_open2 = format("avcodec_open2");
  decltype(&::avcodec_parameters_to_context) avcodec_parameters_to_context = format("avcodec_parameters_to_context");
  decltype(&::avcodec_receive_frame) avcodec_receive_frame = format("avcodec_receive_frame");
  decltype(&::avcodec_receive_packet) avcodec_receive_packet = format("avcodec_receive_packet");
  decltype(&::avcodec_send_frame) avcodec_send_frame = format("avcodec_send_frame");
  decltype(&::avcodec_send_packet) avcodec_send_packet = format("avcodec_send_packet");
  decltype(&::avformat_close_input) avformat_close_input = format("avformat_close_input");
  decltype(&::avformat_find_stream_info) avformat_find_stream_info = format("avformat_find_stream_info");
  decltype(&::avformat_open_input) avformat_open_input = format("avformat_open_input");
  decltype(&::sws_freeContext) sws_freeContext = scale("sws_freeContext");
  decltype(&::sws_getCachedContext) sws_getCachedContext = scale("sws_getCachedContext");
  decltype(&::sws_scale) sws_scale = scale("sws_scale");
};

/// Loads FFmpeg's libraries, of the versions of their headers; any thread. Fails with what to install.
Status load_ffmpeg();

/// @pre load_ffmpeg() has succeeded
const FfmpegLibraries& ffmpeg();

/// Frees objects of FFmpeg's libraries.
struct FreeFfmpeg {
  void operator()(AVCodecContext* context) const { ffmpeg().avcodec_free_context(&context); }
  void operator()(AVFormatContext* context) const { ffmpeg().avformat_close_input(&context); }
  void operator()(AVFrame* frame) const { ffmpeg().av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { ffmpeg().av_packet_free(&packet); }
  void operator()(SwsContext* context) const { ffmpeg().sws_freeContext(context); }
};
template <typename T>
using Ffmpeg = std::unique_ptr<T, FreeFfmpeg>;

/// Text of an error code of FFmpeg's libraries.
inline std::string ffmpeg_reason(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  ffmpeg().av_strerror(code, text, sizeof(text));
  return text;
}

}  // namespace steadyhand
