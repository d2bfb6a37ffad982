#include "steadyhand/operator/protocol/client_clock.hpp"

#include <algorithm>

namespace steadyhand {

void ClientClock::Least::add(Time value, Time now) {
  if (!started || now - since >= kWindow) {
    values = {value, started && now - since < 2 * kWindow ? values[0] : Time::max()};
    since = now;
    started = true;
  }
  values[0] = std::min(values[0], value);
}

Time ClientClock::Least::least(Time otherwise) const {
  const Time smaller = std::min(values[0], values[1]);
  return smaller == Time::max() ? otherwise : smaller;
}

void ClientClock::arrived(Time t, Time now) { offset_.add(now - t, now); }

void ClientClock::round_trip(Time length, Time now) {
  if (length >= Time(0) && length <= kLongestRoundTrip) round_trip_.add(length, now);
}

Time ClientClock::to_session(Time t, Time now) const {
  return std::min(t + offset_.least(now - t) - round_trip() / 2, now);
}

}  // namespace steadyhand
