// Loads the UR5e and asks where its glass is, how it moves with the joints, and how far the arm is from touching
// itself.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "steadyhand/files.hpp"
#include "steadyhand/geometry.hpp"

using namespace steadyhand;

int main() {
  const Result<RobotModel> ur5e = open_robot("ur5e");  // or the path of a robot file or of a URDF
  if (!ur5e) {
    fmt::print(stderr, "{}\n", ur5e.error().message);
    return 2;
  }
  fmt::print("{}: {} joints, {} bodies, {} pairs that must not touch\n", ur5e->name, ur5e->dof(), ur5e->bodies.size(),
             ur5e->pairs.size());

  // The model never changes and may be shared; Kinematics is one thread's scratch beside it and allocates only here.
  Kinematics arm(*ur5e);
  arm.set_position(ur5e->home);
  const Vector3 home = arm.p();
  fmt::print("glass at home: ({:.3f}, {:.3f}, {:.3f}) m, its opening towards ({:.2f}, {:.2f}, {:.2f})\n", home.x(),
             home.y(), home.z(), arm.R()(0, 2), arm.R()(1, 2), arm.R()(2, 2));
  const double clearance_at_home = clearance(arm);
  fmt::print("smallest clearance: {:.1f} mm\n", 1e3 * clearance_at_home);

  // What the liquid feels when all joints turn at 0.5 rad/s and speed up by 1 rad/s^2; at rest it is (0, 0, 9.81).
  arm.set_motion(JointVector::Constant(ur5e->dof(), 0.5), JointVector::Constant(ur5e->dof(), 1.0));
  const Vector3 a = arm.local_acceleration();
  fmt::print("local acceleration in motion: ({:.2f}, {:.2f}, {:.2f}) m/s^2\n", a.x(), a.y(), a.z());

  // The Jacobian's columns are exact: a small turn of each joint moves the glass as they say.
  constexpr double kTurn = 1e-6;
  double worst = 0.0;
  for (int k = 0; k < ur5e->dof(); ++k) {
    arm.set_position(ur5e->home);
    const Vector3 predicted = arm.dp(k);
    JointVector q = ur5e->home;
    q[k] += kTurn;
    arm.set_position(q);
    worst = std::max(worst, ((arm.p() - home) / kTurn - predicted).norm());
  }
  fmt::print("Jacobian against a difference quotient: off by at most {:.1e} m/rad\n", worst);
  return clearance_at_home > 0.0 && worst < 1e-5 ? 0 : 1;
}
