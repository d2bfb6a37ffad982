#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Of a peer, without its port.
struct Address {
  std::string text;       ///< the same for all of loopback
  bool loopback = false;  ///< this machine itself
};

/// Somebody who is connected and has no right to stay.
struct Guest {
  std::uint64_t id = 0;
  Address address;
  Time useful{0};  ///< when it last said something useful, or came
};

/// Connections of loopback that do not count when the address with most of them is sought: nobody on the network can
/// take them away.
constexpr int kLoopbackPlaces = 16;

/// Who leaves when a newcomer finds every place taken: a guest of the address that has most of them, the newcomer
/// counted in, and of these who has said nothing useful for longest. Where addresses have as many, not loopback's.
/// None: there are no guests.
std::optional<std::uint64_t> who_leaves(const std::vector<Guest>& guests, const Address& newcomer);

}  // namespace steadyhand
