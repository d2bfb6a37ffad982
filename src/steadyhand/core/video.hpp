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
  std::string name;       ///< of letters, digits, _ and -
  int width = 320;        ///< pixels, even
  int height = 240;       ///< likewise
  double rate_hz = 15.0;  ///< pictures a second
};
template <typename V>
void describe(V& v, CameraInfo& c) {
  v.type("CameraFacts", "A camera of the session.");
  v.add("name", "", "", c.name);
  v.add("width", "", "pixels", c.width, at_least(2));
  v.add("height", "", "pixels", c.height, at_least(2));
  v.add("rate_hz", "Hz", "pictures a second", c.rate_hz, above(0.0));
}

/// An encoded picture on its way to the recording and the page.
struct VideoPacket {
  int camera = 0;  ///< index of the session's cameras
  /// hand: when the picture was exposed; made: when it was encoded. Session's clock.
  Stamp stamp;
  bool is_key = false;  ///< can be decoded without those before
  std::string data;     ///< H.264, one picture as an Annex B byte stream; key pictures bring their parameter sets
};

/// How a camera goes.
struct CameraState {
  std::uint64_t pictures = 0;  ///< encoded
  std::uint64_t dropped = 0;   ///< came while the encoder was behind
  double latency = 0.0;        ///< s, from exposure until it was encoded, of the newest
  std::string ended;           ///< why no more come; empty: they do
};

/// The cameras of a session. Nobody waits for them; what they cannot do in time they drop.
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
