#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "steadyhand/core/describe.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// A camera of a session.
struct CameraInfo {
  std::string name;       ///< letters, digits, _ and -
  int width = 320;        ///< pixels, even
  int height = 240;       ///< likewise
  double rate_hz = 15.0;  ///< frames per second
};
template <typename V>
void describe(V& v, CameraInfo& c) {
  v.type("CameraFacts", "A camera of the session.");
  v.add("name", "", "", c.name);
  v.add("width", "", "pixels", c.width, at_least(2));
  v.add("height", "", "pixels", c.height, at_least(2));
  v.add("rate_hz", "Hz", "pictures a second", c.rate_hz, above(0.0));
}

/// An encoded frame for the recording and the page.
struct VideoPacket {
  int camera = 0;  ///< index in the session's cameras
  /// hand: when the frame was exposed; made: when it was encoded. Session's clock.
  Stamp stamp;
  bool is_key = false;  ///< can be decoded without earlier frames
  std::string data;     ///< H.264, one frame as an Annex B byte stream; key frames contain their parameter sets
};

/// Status of a camera.
struct CameraState {
  std::uint64_t pictures = 0;  ///< encoded
  std::uint64_t dropped = 0;   ///< arrived while the encoder was behind
  double latency = 0.0;        ///< s, from exposure to encoded, newest frame
  std::string ended;           ///< why the camera stopped; empty: it runs
};

/// The cameras of a session. No other thread waits for them; they drop packets that they cannot handle in time.
class Cameras {
 public:
  /// Takes packets, those of each camera in their order, on threads of the cameras; must not block for long.
  using TakePacket = std::function<void(VideoPacket)>;

  virtual ~Cameras() = default;
  /// A packet's index, and that of a state, counts in these.
  virtual const std::vector<CameraInfo>& cameras() const = 0;
  /// Once.
  virtual void start(TakePacket take) = 0;
  /// No packet from here on.
  virtual void end() = 0;
  /// Any thread.
  virtual std::vector<CameraState> states() const = 0;

 protected:
  Cameras() = default;
};

}  // namespace steadyhand
