#include "steadyhand/geometry/robot/urdf_dynamics.hpp"

#include <fmt/format.h>
#include <urdf_model/joint.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <Eigen/Eigenvalues>

#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

/// Inertia of a link of the URDF, in its frame.
Inertia inertia_of(const urdf::Link& link) {
  if (!link.inertial) return {};
  const urdf::Inertial& read = *link.inertial;
  const Eigen::Isometry3d X = to_eigen(read.origin);
  Matrix3 about;
  about << read.ixx, read.ixy, read.ixz, read.ixy, read.iyy, read.iyz, read.ixz, read.iyz, read.izz;
  return {read.mass, X.translation(), X.linear() * about * X.linear().transpose()};
}

Inertia moved(const Inertia& body, const Eigen::Isometry3d& X) {
  return {body.mass, X * body.center, X.linear() * body.about * X.linear().transpose()};
}

/// Inertia about the origin of a point mass at d, kg m^2.
Matrix3 steiner(double mass, const Vector3& d) {
  return mass * (d.squaredNorm() * Matrix3::Identity() - d * d.transpose());
}

/// Whether some distribution of mass has it: positive, and no principal moment larger than the other two together.
bool is_of_a_body(const Inertia& body) {
  if (!(body.mass > 0.0) || !body.center.allFinite() || !body.about.allFinite()) return false;
  const Vector3 moments = Eigen::SelfAdjointEigenSolver<Matrix3>(body.about, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double kRounding = 1e-6;
  return moments[0] > 0.0 && moments[2] <= (1.0 + kRounding) * (moments[0] + moments[1]);
}

}  // namespace

Inertia operator+(const Inertia& one, const Inertia& other) {
  const double mass = one.mass + other.mass;
  if (!(mass > 0.0)) return {};
  Inertia both{mass, (one.mass * one.center + other.mass * other.center) / mass, one.about + other.about};
  both.about += steiner(one.mass, one.center - both.center) + steiner(other.mass, other.center - both.center);
  return both;
}

Result<ChainDynamics> read_chain_dynamics(const std::filesystem::path& file, const UrdfChain& chain, Xacro xacro) {
  std::vector<UnreadElement> unread;
  const auto urdf = read_urdf(file, xacro, &unread);
  if (!urdf) return urdf.error();
  for (const UnreadElement& each : unread) {
    if (each.element != "inertial") continue;
    return Error{fmt::format("{}: the <inertial> of link '{}' cannot be read: {}; a simulation with contact needs it",
                             each.where, each.link, each.reason)};
  }
  const int n = static_cast<int>(chain.joints.size());
  ChainDynamics dynamics;
  dynamics.links.resize(n + 1);
  for (const auto& [name, link] : (*urdf)->links_) {
    const UrdfChain::Frame& at = chain.frames.at(name);
    const Inertia read = inertia_of(*link);
    if (read.mass > 0.0) dynamics.links[at.link] = dynamics.links[at.link] + moved(read, at.X_link_frame);
  }
  for (int k = 1; k <= n; ++k) {
    if (is_of_a_body(dynamics.links[k])) continue;
    return Error{
        fmt::format("{}: link '{}' has a mass of {:g} kg and principal moments that no body has, or none: a "
                    "simulation with contact needs its <inertial>",
                    file.string(), chain.link_names[k], dynamics.links[k].mass)};
  }
  dynamics.effort_max.resize(n);
  for (int k = 0; k < n; ++k) {
    const urdf::JointConstSharedPtr joint = (*urdf)->getJoint(chain.joints[k].name);
    const double effort = joint && joint->limits ? joint->limits->effort : 0.0;
    if (!(effort > 0.0) || !std::isfinite(effort)) {
      return Error{
          fmt::format("{}: joint '{}' has an effort of {:g}; a simulation with contact needs its largest, "
                      "in Nm (N), above 0",
                      file.string(), chain.joints[k].name, effort)};
    }
    dynamics.effort_max[k] = effort;
  }
  return dynamics;
}

}  // namespace steadyhand
