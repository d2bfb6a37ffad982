#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "steadyhand/core/lanes.hpp"

namespace steadyhand::realtime {

/// Sum of logarithms at the cost of products: multiplies the factors and moves the exponent aside before it can
/// overflow. Factors: positive, between 1e-100 and 1e100.
class LogSum {
 public:
  void add(Lanes factor) {
    product_ *= factor;
    Lanes::Mask bits;
    const Lanes::Vector numbers = product_.vector();
    std::memcpy(&bits, &numbers, sizeof bits);
    exponents_ += (bits >> 52) - kBias;
    bits = (bits & kFraction) | (kBias << 52);
    Lanes::Vector mantissas;
    std::memcpy(&mantissas, &bits, sizeof mantissas);
    product_ = Lanes(mantissas);
  }

  double value() const {
    double sum = 0.0;
    for (int i = 0; i < kLanes; ++i) sum += std::log(product_[i]) + M_LN2 * static_cast<double>(exponents_[i]);
    return sum;
  }

 private:
  static constexpr std::int64_t kBias = 1023, kFraction = (std::int64_t{1} << 52) - 1;
  Lanes product_ = 1.0;  ///< within [1, 2)
  Lanes::Mask exponents_{};
};

}  // namespace steadyhand::realtime
