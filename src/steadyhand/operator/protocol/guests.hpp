#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// A peer's address, without its port.
struct Address {
  std::string text;       ///< the same for all of loopback
  bool loopback = false;  ///< this machine itself
};

/// A connected client that has no right to stay.
struct Guest {
  std::uint64_t id = 0;
  Address address;
  Time useful{0};  ///< when it last sent a useful message, or connected
};

/// Connections of loopback that do not count in the search for the address with most of them: no client on the network
/// can take them away.
constexpr int kLoopbackPlaces = 16;

/// The guest to send away when a newcomer finds every place taken: at the address with most connections, the newcomer
/// counted in, the one that has sent no useful message for longest. If addresses have as many, not loopback's. None:
/// there are no guests.
std::optional<std::uint64_t> who_leaves(const std::vector<Guest>& guests, const Address& newcomer);

}  // namespace steadyhand
