#pragma once

#include <memory>

#include "steadyhand/cameras/video/picture_source.hpp"

namespace steadyhand {

/// Pictures of one camera to video. One thread.
class VideoEncoder {
 public:
  virtual ~VideoEncoder() = default;
  /// The picture's packet, at once. Fails where the library does; its reason.
  virtual Result<VideoPacket> encode(const Picture& picture) = 0;

 protected:
  VideoEncoder() = default;
};

/// H.264 by libx264 within FFmpeg's libavcodec, without pictures that wait for later ones, a key picture each second.
/// Fails on sizes that are odd or not positive, and where the library has no libx264.
Result<std::unique_ptr<VideoEncoder>> make_h264_encoder(const CameraInfo& camera);

}  // namespace steadyhand
