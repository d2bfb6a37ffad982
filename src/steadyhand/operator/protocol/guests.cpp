#include "steadyhand/operator/protocol/guests.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace steadyhand {

std::optional<std::uint64_t> who_leaves(const std::vector<Guest>& guests, const Address& newcomer) {
  std::map<std::string_view, int> crowd;
  for (const Guest& guest : guests) ++crowd[guest.address.text];
  ++crowd[newcomer.text];
  const auto claim = [&](const Guest& guest) {  // the smallest leaves
    const int there = crowd[guest.address.text] - (guest.address.loopback ? kLoopbackPlaces : 0);
    return std::tuple(-std::max(there, 0), guest.address.loopback, guest.useful, guest.id);
  };
  const auto first = std::min_element(guests.begin(), guests.end(),
                                      [&](const Guest& a, const Guest& b) { return claim(a) < claim(b); });
  return first == guests.end() ? std::nullopt : std::optional(first->id);
}

}  // namespace steadyhand
