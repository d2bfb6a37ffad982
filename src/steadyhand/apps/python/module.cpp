#include "steadyhand/apps/python/module.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "steadyhand/core/configuration.hpp"
#include "steadyhand/core/processor.hpp"

namespace steadyhand::python {

namespace {

constexpr double kRigid = 1e-3;  ///< tolerance of a rotation's entries, the same as for a quaternion's length
constexpr double kLatest = 9e9;  ///< s, that a Time holds

std::atomic<int> threads_unlocked{0}, threads_staying{0};
std::atomic<bool> ending{false};
std::thread::id ending_thread;  ///< before `ending`

void stay_if_python_ends() {
  if (!ending || std::this_thread::get_id() == ending_thread) return;
  ++threads_staying;
  while (true) std::this_thread::sleep_for(std::chrono::hours(1));
}

/// Once no other thread is to come back. By Python's atexit, under its lock.
void end_threads() {
  using std::chrono::steady_clock;
  ending_thread = std::this_thread::get_id();
  ending = true;
  {
    const nb::gil_scoped_release unlocked;  // for those that had asked for it before
    const auto latest = steady_clock::now() + std::chrono::seconds(2);
    while (threads_staying < threads_unlocked && steady_clock::now() < latest)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const bool alone = nb::cast<int>(nb::module_::import_("threading").attr("active_count")()) <= 1;
  if (!alone) nb::set_leak_warnings(false);  // objects that daemon threads use are never freed
}

}  // namespace

Unlocked::Unlocked() : state_(PyEval_SaveThread()) { ++threads_unlocked; }

Unlocked::~Unlocked() {
  stay_if_python_ends();
  PyEval_RestoreThread(state_);
  --threads_unlocked;
}

Locked::Locked() {
  stay_if_python_ends();
  state_ = PyGILState_Ensure();
}

JointVector to_joints(const Row& row) {
  return Eigen::Map<const Eigen::VectorXd>(row.data(), static_cast<Eigen::Index>(row.shape(0)));
}

Pose to_pose(const double* T, const char* name) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(T);
  const Matrix3 R = matrix.topLeftCorner<3, 3>();
  const double off = (R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff();
  if (!matrix.allFinite()) throw Refused(fmt::format("{} has numbers that are not finite", name));
  if (off > kRigid || R.determinant() < 0.0) {
    throw Refused(
        fmt::format("{} is no pose: its first three rows and columns must be a rotation R, but R'R is off the "
                    "identity by {:.3g} and its determinant {:.3g}",
                    name, off, R.determinant()));
  }
  if ((matrix.row(3) - Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)).cwiseAbs().maxCoeff() > kRigid) {
    throw Refused(fmt::format("{} is no pose: its last row is [{}, {}, {}, {}]; it must be [0, 0, 0, 1]", name,
                              matrix(3, 0), matrix(3, 1), matrix(3, 2), matrix(3, 3)));
  }
  return {matrix.topRightCorner<3, 1>(), Quaternion(R).normalized()};
}

Time to_time(double seconds, const char* name) {
  if (!(std::abs(seconds) <= kLatest))
    throw Refused(fmt::format("{} is {} s; it must be finite, at most 9e9", name, seconds));
  return from_seconds(seconds);
}

nb::object make_array(const std::vector<std::size_t>& shape, double*& data) {
  std::size_t size = 1;
  for (const std::size_t extent : shape) size *= extent;
  data = new double[size];
  nb::capsule owner(data, [](void* memory) noexcept { delete[] static_cast<double*>(memory); });
  return nb::cast(nb::ndarray<nb::numpy, double>(data, shape.size(), shape.data(), owner));
}

void write_pose(const Vector3& p, const Matrix3& R, double* T) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(T);
  matrix.setIdentity();
  matrix.topLeftCorner<3, 3>() = R;
  matrix.topRightCorner<3, 1>() = p;
}

nb::object from_pose(const Vector3& p, const Matrix3& R) {
  double* data = nullptr;
  nb::object array = make_array({4, 4}, data);
  write_pose(p, R, data);
  return array;
}

}  // namespace steadyhand::python

NB_MODULE(_native, module) {
  using namespace steadyhand;
  module.attr("version") = STEADYHAND_VERSION;
  module.attr("processor") = python::to_text(compiled_processor());
  nanobind::exception<python::Refused>(module, "SteadyhandError", PyExc_ValueError);
  module.def("names_in", [](const std::string& folder) {
    nanobind::list names;
    for (const std::string& name : names_in(Places::standard(), folder)) names.append(nanobind::str(name.c_str()));
    return names;
  });
  nanobind::module_::import_("atexit").attr("register")(nanobind::cpp_function(&python::end_threads));
  python::bind_robot(module);
  python::bind_cell(module);
  python::bind_planner(module);
  python::bind_objective(module);
  python::bind_stages(module);
  python::bind_replay(module);
  python::bind_simulate(module);
  python::bind_solve(module);
}
