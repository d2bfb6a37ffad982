#pragma once

#include <cstdint>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/video.hpp"

namespace steadyhand {

/// What a camera saw.
struct Picture {
  int camera = 0;                 ///< index of PictureSource::cameras
  Time exposed{0};                ///< session's clock
  int left_out = 0;               ///< that were due since the one before, and came to nothing
  std::vector<std::uint8_t> rgb;  ///< 3 bytes a pixel, rows from the top, as many as CameraInfo says
};

/// One camera or several that take turns on one thread. Knows nothing of encoding.
class PictureSource {
 public:
  virtual ~PictureSource() = default;
  /// At least one.
  virtual const std::vector<CameraInfo>& cameras() const = 0;
  /// Waits for the next picture, at most some 0.1 s, so that whoever calls can end. One thread, from the first call
  /// on. False: there is none yet. Fails, with the reason, once no more will come.
  virtual Result<bool> take(Picture& picture) = 0;

 protected:
  PictureSource() = default;
};

}  // namespace steadyhand
