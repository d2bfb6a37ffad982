#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "steadyhand/cameras/video/picture_source.hpp"
#include "steadyhand/cameras/video/video_encoder.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// The running cameras of a session: one thread takes the pictures of each source, another encodes those of each
/// camera. No other thread waits for them. A camera whose encoder is late drops pictures and counts them. A camera that
/// fails reports why and ends; the others continue.
class CameraSet final : public Cameras {
 public:
  using MakeEncoder = std::function<Result<std::unique_ptr<VideoEncoder>>(const CameraInfo&)>;

  /// The clock must outlive it. Fails as make_encoder does, or if a name is invalid or used twice.
  static Result<std::unique_ptr<CameraSet>> make(std::vector<std::unique_ptr<PictureSource>> sources, Clock& clock,
                                                 const MakeEncoder& make_encoder = make_h264_encoder);
  /// Ends the threads, like end().
  ~CameraSet() override;

  /// Cameras of all sources, in the order of the sources.
  const std::vector<CameraInfo>& cameras() const override { return cameras_; }
  void start(TakePacket take) override;
  void end() override;
  std::vector<CameraState> states() const override;

 private:
  static constexpr std::size_t kMostWaiting = 4;  ///< pictures, for each encoder

  struct Camera {
    std::unique_ptr<VideoEncoder> encoder;
    mutable std::mutex mutex;  ///< guards the members below
    std::condition_variable_any changed;
    std::deque<Picture> waiting;
    std::vector<std::vector<std::uint8_t>> spare;  ///< pixel buffers for reuse
    CameraState state;
  };

  explicit CameraSet(Clock& clock) : clock_(&clock) {}
  void film(const std::stop_token& stop, PictureSource& source, std::size_t first);
  void encode(const std::stop_token& stop, Camera& camera, int index, const TakePacket& take);
  void offer(Camera& camera, Picture& picture);
  static void fail(Camera& camera, const std::string& why);

  Clock* clock_;
  std::vector<std::unique_ptr<PictureSource>> sources_;
  std::vector<CameraInfo> cameras_;
  std::vector<std::unique_ptr<Camera>> at_work_;  ///< of cameras_
  std::vector<std::jthread> threads_;
};

}  // namespace steadyhand
