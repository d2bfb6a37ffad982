#pragma once

#include <string>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Collects the samples of one recording and refuses those that no hand can have made. Both readers feed it, so both
/// formats obey the same rules.
class SampleList {
 public:
  /// Values of the file, in robot axes.
  struct Row {
    double t = 0.0;  ///< s
    Vector3 p = Vector3::Zero();
    Quaternion q = Quaternion::Identity();
    bool clutch = true;
  };

  /// Times count from the first row. `where` goes before the message: the file and the line or key.
  Status add(const Row& row, const std::string& where);

  /// The samples of [from, until] (s), their times counted from the first of them. `where`: the file.
  Result<std::vector<OperatorSample>> take(double from, double until, const std::string& where) &&;

 private:
  std::vector<OperatorSample> samples_;
  double start_ = 0.0;     ///< s, the first row's time
  double previous_ = 0.0;  ///< s, the last row's time
};

}  // namespace steadyhand
