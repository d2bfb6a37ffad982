// Prints what the kinematics make of random states, for the test in Python that compares them with Pinocchio.
//   kinematics_dump ROBOT < states > results
// Both streams are doubles in the machine's own form. One state: q, dq, ddq (3n). One result: p (3), R by rows (9),
// dp/dq by columns (3n), angular velocity per joint (3n), local acceleration (3), sphere centres (3 each).
#include <cstdio>
#include <vector>

#include "steadyhand/files/config/open.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace {

using namespace steadyhand;

void append(std::vector<double>& row, const Vector3& v) { row.insert(row.end(), v.data(), v.data() + 3); }

std::vector<double> result_row(Kinematics& arm, const JointVector& q, const JointVector& dq, const JointVector& ddq) {
  arm.set_position(q);
  arm.set_motion(dq, ddq);
  std::vector<double> row;
  append(row, arm.p());
  for (int i = 0; i < 3; ++i) append(row, arm.R().row(i).transpose());
  for (int k = 0; k < arm.dof(); ++k) append(row, arm.dp(k));
  for (int k = 0; k < arm.dof(); ++k) append(row, arm.axis(k));
  append(row, arm.local_acceleration());
  for (std::size_t i = 0; i < arm.model().bodies.size(); ++i) append(row, arm.body(static_cast<int>(i)).p);
  return row;
}

}  // namespace

int main(int argc, char** argv) {
  const auto model = open_robot(argc == 2 ? argv[1] : "");
  if (!model) {
    std::fprintf(stderr, "kinematics_dump: %s\n", model.error().message.c_str());
    return 2;
  }
  const int n = model->dof();
  Kinematics arm(*model);
  std::vector<double> state(3 * n);
  while (std::fread(state.data(), sizeof(double), state.size(), stdin) == state.size()) {
    const Eigen::Map<const Eigen::VectorXd> z(state.data(), 3 * n);
    const std::vector<double> row = result_row(arm, z.head(n), z.segment(n, n), z.tail(n));
    if (std::fwrite(row.data(), sizeof(double), row.size(), stdout) != row.size()) return 2;
  }
  return 0;
}
