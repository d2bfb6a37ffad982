#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/spsc_ring.hpp"
#include "steadyhand/core/video.hpp"

namespace steadyhand {

/// Camera frames on their way from the cameras' threads to the server's. Their priorities differ much, so no side waits
/// for the other or takes a lock that it holds. Frames that come too fast for the server's thread are dropped, up to
/// the camera's next key frame.
class PictureInlet {
 public:
  /// As clients get it.
  struct Message {
    int camera = 0;
    bool is_key = false;
    std::shared_ptr<const std::string> text;  ///< as picture_message() makes it
  };

  /// Error: no file descriptor to be had.
  static Result<std::shared_ptr<PictureInlet>> make(std::size_t cameras);
  ~PictureInlet();
  PictureInlet(const PictureInlet&) = delete;
  PictureInlet& operator=(const PictureInlet&) = delete;

  /// Frames of one camera: from one thread at a time.
  void put(const VideoPacket& packet);

  /// Readable once something was put. It and the following functions are for the server's thread.
  int descriptor() const { return descriptor_; }
  /// Call before take(): frames that are put later are signalled again.
  void hear();
  /// False: there is none.
  bool take(Message& message);

 private:
  static constexpr std::size_t kMost = 16;  ///< waiting frames of a camera: a second
  struct Camera {
    SpscRing<Message> ring{kMost};
    bool needs_key = false;  ///< the camera's thread: the frame before was dropped
  };

  explicit PictureInlet(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
  std::deque<Camera> cameras_;  ///< never moved
};

}  // namespace steadyhand
