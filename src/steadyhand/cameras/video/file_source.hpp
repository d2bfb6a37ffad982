#pragma once

#include <memory>
#include <string>

#include "steadyhand/cameras/video/picture_source.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Plays a video file like a camera. At the end of the file the camera ends, as if it were unplugged. Pictures are
/// scaled to the camera's size; if the file's rate is higher than the camera's, some are left out. The exposure time of
/// a picture is when it is due.
/// The clock must outlive it. Fails on files without video that FFmpeg's libavformat and libavcodec can read.
Result<std::unique_ptr<PictureSource>> open_file_source(const std::string& path, const CameraInfo& camera,
                                                        Clock& clock);

}  // namespace steadyhand
