#pragma once

#include <memory>
#include <string>

#include "steadyhand/cameras/video/picture_source.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// A device file, as the kernel's Video4Linux2 has it.
class V4l2Device {
 public:
  virtual ~V4l2Device() = default;
  /// As ioctl(2): 0, or errno.
  virtual int control(unsigned long request, void* argument) = 0;
  /// The memory of a buffer, until the device's end; null: there is none.
  virtual const std::uint8_t* map(std::size_t bytes, std::int64_t offset) = 0;
  /// Waits for a picture, for so long at most: 0, or errno.
  virtual int wait(Time most) = 0;

 protected:
  V4l2Device() = default;
};

/// Errors: not there, no permission.
Result<std::unique_ptr<V4l2Device>> open_v4l2_device(const std::string& path);

/// A camera of hardware: what it gives uncompressed or as MJPEG, in the size and at the rate that come nearest, scaled
/// to the camera's size. A picture counts as exposed when the driver says, by CLOCK_MONOTONIC, which must be the
/// session's clock; where it has no such stamp, when the picture came. Who is behind gets the newest.
/// The clock must outlive it. Fails, naming `path`, on what is no camera, has no such format, or is in use.
Result<std::unique_ptr<PictureSource>> make_v4l2_source(const std::string& path, std::unique_ptr<V4l2Device> device,
                                                        const CameraInfo& camera, Clock& clock);

}  // namespace steadyhand
