#pragma once

#include <memory>
#include <string>

#include "steadyhand/cameras/video/picture_source.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// A Video4Linux2 device file.
class V4l2Device {
 public:
  virtual ~V4l2Device() = default;
  /// Like ioctl(2): 0, or errno.
  virtual int control(unsigned long request, void* argument) = 0;
  /// The memory of a buffer, valid until the device is destroyed; null: there is none.
  virtual const std::uint8_t* map(std::size_t bytes, std::int64_t offset) = 0;
  /// Waits for a picture, at most this long: 0, or errno.
  virtual int wait(Time most) = 0;

 protected:
  V4l2Device() = default;
};

/// Fails if the file does not exist, is no Video4Linux2 device, or cannot be opened.
Result<std::unique_ptr<V4l2Device>> open_v4l2_device(const std::string& path);

/// A hardware camera. It reads uncompressed pictures or MJPEG, in the nearest size and rate, scaled to the camera's
/// size. The exposure time is the driver's stamp by CLOCK_MONOTONIC, which must be the session's clock; without such a
/// stamp it is the time of arrival. A late reader gets the newest picture.
/// The clock must outlive it. Fails, naming `path`, if it is no camera, has no such format, or is in use.
Result<std::unique_ptr<PictureSource>> make_v4l2_source(const std::string& path, std::unique_ptr<V4l2Device> device,
                                                        const CameraInfo& camera, Clock& clock);

}  // namespace steadyhand
