#include "steadyhand/geometry/robot/model.hpp"

#include <algorithm>

namespace steadyhand {

std::vector<int> RobotModel::chain(int link) const {
  std::vector<int> result;
  for (; link > 0; link = parent(link - 1)) result.push_back(link - 1);
  std::reverse(result.begin(), result.end());
  return result;
}

std::vector<SignedJoint> way_between(const RobotModel& model, int first, int last) {
  const std::vector<int> from = model.chain(first), to = model.chain(last);
  const auto [end, begin] = std::mismatch(from.begin(), from.end(), to.begin(), to.end());
  std::vector<SignedJoint> way;
  for (auto k = from.end(); k != end;) way.push_back({*--k, -1.0});
  for (auto k = begin; k != to.end(); ++k) way.push_back({*k, 1.0});
  return way;
}

}  // namespace steadyhand
