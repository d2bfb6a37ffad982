#pragma once

#include <cstdint>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/video.hpp"

namespace steadyhand {

/// A picture of a camera.
struct Picture {
  int camera = 0;                 ///< index of PictureSource::cameras
  Time exposed{0};                ///< session's clock
  int left_out = 0;               ///< pictures due since the one before that were not delivered
  std::vector<std::uint8_t> rgb;  ///< 3 bytes a pixel, rows from the top, size as in CameraInfo
};

/// One camera, or several that take turns on one thread. Does not encode.
class PictureSource {
 public:
  virtual ~PictureSource() = default;
  /// At least one.
  virtual const std::vector<CameraInfo>& cameras() const = 0;
  /// Waits at most about 0.1 s for the next picture, so that its caller can end. Call it from one thread only. False:
  /// there is none yet. Fails, with the reason, if no more will come.
  virtual Result<bool> take(Picture& picture) = 0;

 protected:
  PictureSource() = default;
};

}  // namespace steadyhand
