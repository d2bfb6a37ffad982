#pragma once

#include <memory>

#include "steadyhand/cameras/video/picture_source.hpp"

namespace steadyhand {

/// Encodes the pictures of one camera as video. One thread.
class VideoEncoder {
 public:
  virtual ~VideoEncoder() = default;
  /// Returns the picture's packet immediately. Fails if the library does, with its reason.
  virtual Result<VideoPacket> encode(const Picture& picture) = 0;

 protected:
  VideoEncoder() = default;
};

/// H.264 by libx264 in FFmpeg's libavcodec: no picture depends on a later one, one key picture a second.
/// Fails on sizes that are odd or not positive, or if the library has no libx264.
Result<std::unique_ptr<VideoEncoder>> make_h264_encoder(const CameraInfo& camera);

}  // namespace steadyhand
