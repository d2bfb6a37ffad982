#include "steadyhand/apps/python/robot.hpp"

#include "steadyhand/apps/python/module.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand::python {

namespace {

std::unique_ptr<Robot> open(const std::string& name) {
  const Unlocked unlocked;  // looks for pairs, which takes a while
  return std::make_unique<Robot>(value_of(open_robot(name)));
}

Kinematics& at(Robot& robot, const Row& q) {
  robot.arm.set_position(to_joints(q));
  return robot.arm;
}

nb::object fk(Robot& robot, const Row& q, int tool) {
  const Kinematics& arm = at(robot, q);
  return from_pose(arm.p(tool), arm.R(tool));
}

nb::object jacobian(Robot& robot, const Row& q, int tool) {
  const Kinematics& arm = at(robot, q);
  const int n = arm.dof();
  double* data = nullptr;
  nb::object array = make_array({6, static_cast<std::size_t>(n)}, data);
  Eigen::Map<Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>> J(data, 6, n);
  J.setZero();
  for (const int k : arm.chain(tool)) J.col(k) << arm.dp(k, tool), arm.axis(k);
  return array;
}

nb::object local_acceleration(Robot& robot, const Row& q, const Row& dq, const Row& ddq, int tool) {
  Kinematics& arm = at(robot, q);
  arm.set_motion(to_joints(dq), to_joints(ddq));
  return from_vector(arm.local_acceleration(tool));
}

nb::object body_centers(Robot& robot, const Row& q) {
  const Kinematics& arm = at(robot, q);
  const std::size_t count = robot.model->bodies.size();
  double* data = nullptr;
  nb::object array = make_array({count, 3}, data);
  for (std::size_t i = 0; i < count; ++i) Eigen::Map<Vector3>(data + 3 * i) = arm.body(static_cast<int>(i)).p;
  return array;
}

nb::tuple reach(const Robot& robot, int tool) {
  Reach ball;
  {
    const Unlocked unlocked;
    ball = compute_reach(*robot.model, tool);
  }
  return nb::make_tuple(from_vector(ball.center), ball.radius);
}

}  // namespace

void bind_robot(nb::module_& module) {
  nb::class_<Robot>(module, "Robot")
      .def_static("open", &open)
      .def_prop_ro("json", [](const Robot& robot) { return robot_json(*robot.model); })
      .def_prop_ro("doubts",
                   [](const Robot& robot) {
                     nb::list doubts;
                     for (const std::string& doubt : doubts_about(*robot.model)) doubts.append(nb::str(doubt.c_str()));
                     return doubts;
                   })
      .def("fk", &fk, nb::arg("q"), nb::arg("tool") = 0)
      .def("jacobian", &jacobian, nb::arg("q"), nb::arg("tool") = 0)
      .def("clearance", [](Robot& robot, const Row& q) { return clearance(at(robot, q)); })
      .def("local_acceleration", &local_acceleration, nb::arg("q"), nb::arg("dq"), nb::arg("ddq"), nb::arg("tool") = 0)
      .def("body_centers", &body_centers)
      .def("reach", &reach, nb::arg("tool") = 0);
}

}  // namespace steadyhand::python
