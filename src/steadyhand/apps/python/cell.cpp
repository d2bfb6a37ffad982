#include <fmt/format.h>

#include "steadyhand/apps/python/module.hpp"
#include "steadyhand/apps/python/robot.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"

namespace steadyhand::python {

namespace {

/// @param sizes those of the shape, in the order of their names in Python
Shape make_shape(const std::string& shape, const std::vector<double>& sizes) {
  if (shape == "sphere") return Shape::sphere(sizes.at(0));
  if (shape == "capsule") return Shape::capsule(0.5 * sizes.at(1), sizes.at(0));
  if (shape == "cylinder") return Shape::cylinder(sizes.at(0), 0.5 * sizes.at(1));
  if (shape == "half_space") return Shape::half_space();
  const double rounding = sizes.at(3);
  return Shape::box(0.5 * Vector3(sizes.at(0), sizes.at(1), sizes.at(2)) - Vector3::Constant(rounding), rounding);
}

void add_object(Cell& cell, const std::string& name, const std::string& shape, const std::vector<double>& sizes,
                const Matrix4& T_base_object, const Row& velocity, double margin,
                const std::vector<std::string>& may_be_touched_by) {
  CellObject object;
  object.name = name;
  object.shape = make_shape(shape, sizes);
  const Pose pose = to_pose(T_base_object.data(), (name + ": T_base_object").c_str());
  object.origin = Eigen::Translation3d(pose.p) * pose.q;
  object.velocity = Vector3(velocity(0), velocity(1), velocity(2));
  object.margin = margin;
  object.may_be_touched_by = may_be_touched_by;
  cell.objects.push_back(object);
}

nb::dict distances(Robot& robot, const Cell& cell, const Row& q) {
  const Obstacles obstacles = value_of(obstacles_of(cell, *robot.model));
  robot.arm.set_position(to_joints(q));
  nb::dict result;
  for (int i = 0; i < obstacles.count; ++i) {
    result[to_text(cell.objects[i].name)] = nearest_body(robot.arm, obstacles, i, 0.0).distance;
  }
  return result;
}

}  // namespace

void bind_cell(nb::module_& module) {
  module.attr("FIRST_CARRIED") = solid_of(0);
  nb::class_<Cell>(module, "Cell")
      .def(nb::init<>())
      .def_static("open", [](const std::string& name) { return value_of(open_cell(name)); })
      .def_rw("name", &Cell::name)
      .def_prop_ro("names",
                   [](const Cell& cell) {
                     nb::list names;
                     for (const CellObject& object : cell.objects) names.append(to_text(object.name));
                     return names;
                   })
      .def_prop_ro("json", [](const Cell& cell) { return cell_json(cell); })
      .def("add", &add_object)
      .def("attach",
           [](const Cell& cell, const std::string& name, Robot& robot, const Row& q) {
             robot.arm.set_position(to_joints(q));
             return value_of(attach(cell, name, robot.arm));
           })
      .def("detach",
           [](const Cell& cell, const std::string& name, Robot& robot, const Row& q) {
             robot.arm.set_position(to_joints(q));
             return value_of(detach(cell, name, robot.arm));
           })
      .def("distances", [](const Cell& cell, Robot& robot, const Row& q) { return distances(robot, cell, q); });
}

}  // namespace steadyhand::python
