#pragma once

#include <memory>
#include <string>

#include "steadyhand/cameras/video/picture_source.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// A video file that plays as if it were a camera, from its begin to its end, which is the camera's: it is unplugged
/// then. Pictures are scaled to the camera's size; of a faster file some are left out. A picture counts as exposed when
/// it is due.
/// The clock must outlive it. Fails on files without video that FFmpeg's libavformat and libavcodec can read.
Result<std::unique_ptr<PictureSource>> open_file_source(const std::string& path, const CameraInfo& camera,
                                                        Clock& clock);

}  // namespace steadyhand
