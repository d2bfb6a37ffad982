#include <fmt/format.h>

#include "steadyhand/apps/python/options.hpp"
#include "steadyhand/apps/python/robot.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"

namespace steadyhand::python {

namespace {

nb::tuple retarget(Retargeter& retargeter, const Matrix4& T_operator_hand, double t, bool clutch,
                   const Matrix4& T_base_tool) {
  const Time now = to_time(t, "t");
  const Target target = retargeter.update({{now, now}, to_pose(T_operator_hand.data(), "T_operator_hand"), clutch},
                                          to_pose(T_base_tool.data(), "T_base_tool"));
  return nb::make_tuple(from_pose(target.X_base_tool.p, target.X_base_tool.q.toRotationMatrix()), target.engaged);
}

void bind_retargeter(nb::module_& module) {
  nb::class_<Retargeter>(module, "Retargeter")
      .def("__init__",
           [](Retargeter* self, const nb::dict& options) { new (self) Retargeter(retarget_settings(options)); })
      .def("update", &retarget)
      .def("release", &Retargeter::release)
      .def("set_scale", &Retargeter::set_scale)
      .def("set_yaw", &Retargeter::set_yaw)
      .def("set_tilt", [](Retargeter& retargeter, double tilt) { retargeter.set_tilt_max(to_tilt(tilt)); });
}

void make_predictor(Predictor* self, const Robot* robot, int horizon, double dt, double window, double max_gap,
                    const std::string& prediction) {
  PredictorSettings settings;
  settings.horizon = horizon;
  settings.dt = dt;
  settings.window = window;
  settings.max_gap = max_gap;
  const auto model = prediction_of(prediction);
  if (!model) throw Refused(fmt::format("prediction is '{}'; it must be constant_velocity or decaying", prediction));
  settings.model = *model;
  if (robot != nullptr) {
    const Reach reach = compute_reach(*robot->model);
    settings.reach_center = reach.center;
    settings.reach = reach.radius;
  }
  new (self) Predictor(settings);
}

void aim(Predictor& predictor, const Matrix4& T_base_tool, double t, bool engaged) {
  const Time now = to_time(t, "t");
  predictor.update({{now, now}, to_pose(T_base_tool.data(), "T_base_tool"), engaged, Time(0)});
}

nb::object predict(const Predictor& predictor, double t) {
  const Reference reference = predictor.predict(to_time(t, "t"));
  double* data = nullptr;
  nb::object array = make_array({static_cast<std::size_t>(reference.nodes), 4, 4}, data);
  for (int k = 0; k < reference.nodes; ++k) write_pose(reference.tools[0].p[k], reference.tools[0].R[k], data + 16 * k);
  return array;
}

void bind_predictor(nb::module_& module) {
  nb::class_<Predictor>(module, "Predictor")
      .def("__init__", &make_predictor, nb::arg("robot").none(), nb::arg("horizon"), nb::arg("dt"), nb::arg("window"),
           nb::arg("max_gap"), nb::arg("prediction"))
      .def("update", &aim)
      .def("at",
           [](const Predictor& predictor, double t) {
             const Pose pose = predictor.at(to_time(t, "t"));
             return from_pose(pose.p, pose.q.toRotationMatrix());
           })
      .def("spread",
           [](const Predictor& predictor, double t) {
             const Spread spread = predictor.spread(to_time(t, "t"));
             return nb::make_tuple(spread.along, spread.across);
           })
      .def("predict", &predict)
      .def_prop_ro("velocity", [](const Predictor& predictor) { return from_vector(predictor.velocity()); })
      .def_prop_ro("angular_velocity",
                   [](const Predictor& predictor) { return from_vector(predictor.angular_velocity()); });
}

nb::tuple slosh(Liquid& liquid, double dt, const Row& local_acceleration) {
  constexpr double kStep = 1e-3;  // s; the model is integrated explicitly
  const int steps = std::max(1, static_cast<int>(std::ceil(dt / kStep)));
  const Vector3 acceleration(local_acceleration(0), local_acceleration(1), local_acceleration(2));
  for (int i = 0; i < steps; ++i) liquid.update(dt / steps, acceleration);
  const LiquidState& state = liquid.state();
  return nb::make_tuple(state.tilt_x, state.tilt_y, state.freeboard, state.spilled, state.spilled_share);
}

void bind_liquid(nb::module_& module) {
  nb::class_<Liquid>(module, "Liquid")
      .def("__init__", [](Liquid* self, nb::tuple glass) { new (self) Liquid(to_glass(glass)); })
      .def_static("mode",
                  [](nb::tuple glass) {
                    return nb::make_tuple(slosh_frequency(to_glass(glass)), slosh_damping(to_glass(glass)));
                  })
      .def("reset", [](Liquid& liquid) { liquid.reset(); })
      .def("update", &slosh);
}

}  // namespace

void bind_stages(nb::module_& module) {
  bind_retargeter(module);
  bind_predictor(module);
  bind_liquid(module);
}

}  // namespace steadyhand::python
