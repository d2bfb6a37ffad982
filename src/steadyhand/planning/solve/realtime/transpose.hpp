#pragma once

#include <array>
#include <utility>

#include "steadyhand/core/lanes.hpp"

namespace steadyhand::realtime {

/// Swaps lane i of a and lane i - `half` of b for each i that has the bit `half`.
template <int half, int... i>
void swap_lanes(Lanes& a, Lanes& b, std::integer_sequence<int, i...> /*lanes*/) {
  const Lanes::Vector from_a = a.vector(), from_b = b.vector();
  a = Lanes(Lanes::Vector(__builtin_shufflevector(from_a, from_b, ((i & half) != 0 ? kLanes + i - half : i)...)));
  b = Lanes(Lanes::Vector(__builtin_shufflevector(from_a, from_b, ((i & half) != 0 ? kLanes + i : i + half)...)));
}

/// Lane j of the i-th goes to lane i of the j-th.
template <int half = kLanes / 2>
void transpose(std::array<Lanes, kLanes>& square) {
  if constexpr (half > 0) {
#pragma GCC unroll 8
    for (int i = 0; i < kLanes; ++i) {
      if ((i & half) == 0) swap_lanes<half>(square[i], square[i + half], std::make_integer_sequence<int, kLanes>());
    }
    transpose<half / 2>(square);
  }
}

}  // namespace steadyhand::realtime
