#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/spsc_ring.hpp"
#include "steadyhand/core/video.hpp"

namespace steadyhand {

/// Pictures on their way from the cameras' threads to the server's, which are of very different priority: no side waits
/// for the other or takes a lock that it holds. What the server's thread is too late for is dropped, up to the camera's
/// next key picture.
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

  /// Those of a camera on one thread at a time.
  void put(const VideoPacket& packet);

  /// Can be read once something was put; for the server's thread, as what follows.
  int descriptor() const { return descriptor_; }
  /// Before taking: what is put from here on is told anew.
  void hear();
  /// False: there is none.
  bool take(Message& message);

 private:
  static constexpr std::size_t kMost = 16;  ///< pictures of a camera that wait: a second
  struct Camera {
    SpscRing<Message> ring{kMost};
    bool needs_key = false;  ///< the camera's thread: what came before was dropped
  };

  explicit PictureInlet(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
  std::deque<Camera> cameras_;  ///< never moved
};

}  // namespace steadyhand
