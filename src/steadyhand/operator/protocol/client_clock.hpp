#pragma once

#include <array>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// When something happened on a client, by the session's clock.
///
/// Each message has a time t, at which the client says it was sent, and an arrival time a. The smallest a - t of the
/// last seconds belongs to the message with the least delay: clock offset plus the shortest way here. This way is taken
/// as half the shortest round trip, measured with pings: offset = min(a - t) - min(round trip) / 2. Both minima are of
/// two alternating windows of kWindow, so drift and a change of the client's clock are forgotten after two windows. The
/// result is never later than the arrival. Without pings the way here counts as zero: hands then seem younger than they
/// are by the shortest delay. One thread.
class ClientClock {
 public:
  static constexpr Time kWindow = std::chrono::seconds(5);
  static constexpr Time kLongestRoundTrip = std::chrono::seconds(1);

  /// A message that the client sent at `t` by its clock arrived now.
  void arrived(Time t, Time now);
  /// A round trip of this length was measured; those that cannot be are ignored.
  void round_trip(Time length, Time now);
  /// The client's `t` by the session's clock, at most `now`. @pre arrived() was called
  Time to_session(Time t, Time now) const;
  /// The shortest of the last windows; zero before the first.
  Time round_trip() const { return round_trip_.least(Time(0)); }

 private:
  /// Smallest value of the last one to two windows.
  struct Least {
    std::array<Time, 2> values{Time::max(), Time::max()};
    Time since{0};
    bool started = false;
    void add(Time value, Time now);
    Time least(Time otherwise) const;
  };
  Least offset_, round_trip_;
};

}  // namespace steadyhand
