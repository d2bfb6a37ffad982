#pragma once

#include "steadyhand/core/math.hpp"

namespace steadyhand {

/// The smallest rotation that takes one direction, of any length above 0, to another. As Eigen's FromTwoVectors without
/// its singular value decomposition, which takes seconds to compile in each file.
Quaternion turn_between(const Vector3& from, const Vector3& to);

}  // namespace steadyhand
