#include "steadyhand/cameras/video/ffmpeg.hpp"

#include <fmt/format.h>

namespace steadyhand {

namespace {

Result<FfmpegLibraries> load_all() {
  const auto format = SharedLibrary::load({fmt::format("libavformat.so.{}", LIBAVFORMAT_VERSION_MAJOR)});
  if (!format) return format.error();
  const auto scale = SharedLibrary::load({fmt::format("libswscale.so.{}", LIBSWSCALE_VERSION_MAJOR)});
  if (!scale) return scale.error();
  const FfmpegLibraries all{*format, *scale};
  if (Status s = all.format.complete(); !s) return s.error();
  if (Status s = all.scale.complete(); !s) return s.error();
  all.av_log_set_level(AV_LOG_QUIET);  // errors are reported by their codes
  return all;
}

const Result<FfmpegLibraries>& loaded() {
  static const Result<FfmpegLibraries> libraries = load_all();
  return libraries;
}

}  // namespace

Status load_ffmpeg() {
  if (loaded()) return Done{};
  return Error{fmt::format(
      "cameras need FFmpeg's libraries: {}; install them, on Debian with 'apt install libavcodec{} "
      "libavformat{} libswscale{}'; if your system has another version, build from a checkout",
      loaded().error().message, LIBAVCODEC_VERSION_MAJOR, LIBAVFORMAT_VERSION_MAJOR, LIBSWSCALE_VERSION_MAJOR)};
}

const FfmpegLibraries& ffmpeg() { return *loaded(); }

}  // namespace steadyhand
