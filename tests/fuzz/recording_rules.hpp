#pragma once

#include <cmath>

#include "fuzz/fuzz.hpp"
#include "steadyhand/files/input/recording.hpp"

namespace steadyhand::fuzz {

/// The guarantees of load_recording for every recording that it accepts.
inline void check(const Result<Recording>& recording) {
  if (!recording) return require(!recording.error().message.empty(), "a refusal says why");
  require(recording->samples.size() >= 2, "two samples");
  Time last{-1};
  for (const OperatorSample& sample : recording->samples) {
    require(sample.stamp.hand > last, "times increase from 0");
    last = sample.stamp.hand;
    require(sample.X_operator_hand.p.allFinite() && sample.X_operator_hand.p.cwiseAbs().maxCoeff() <= 100.001,
            "a place");
    require(std::abs(sample.X_operator_hand.q.norm() - 1.0) < 1e-9, "a rotation");
  }
  require(recording->samples.front().stamp.hand == Time(0), "times from 0");
}

}  // namespace steadyhand::fuzz
