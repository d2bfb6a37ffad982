#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"

/// steadyhand._native: what python/steadyhand/ is made of. It takes arrays whose shapes Python has checked, and no more
/// than that is its own; what a user sees, and its documentation, is written in Python.
namespace steadyhand::python {

namespace nb = nanobind;

// One file each, NAME.cpp.
void bind_robot(nb::module_& module);
void bind_cell(nb::module_& module);
void bind_planner(nb::module_& module);
void bind_stages(nb::module_& module);
void bind_objective(nb::module_& module);
void bind_replay(nb::module_& module);
void bind_simulate(nb::module_& module);
void bind_solve(nb::module_& module);

/// The reason why something was refused, in the program's words; in Python a SteadyhandError.
struct Refused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The value, or its error thrown.
template <typename T>
T value_of(Result<T> result) {
  if (!result) throw Refused(result.error().message);
  return *std::move(result);
}
inline void check(const Status& status) {
  if (!status) throw Refused(status.error().message);
}

// ---- Python's lock. When the interpreter ends, a running thread that asks for the lock is unwound, and C++ aborts.
// Therefore from then on threads do not ask for it: they stay where they are until the process has ended.
/// Without the lock while this lives.
class Unlocked {
 public:
  Unlocked();
  ~Unlocked();
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  PyThreadState* state_;
};
/// With the lock again, inside of Unlocked.
class Locked {
 public:
  Locked();
  ~Locked() { PyGILState_Release(state_); }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;

 private:
  PyGILState_STATE state_;
};

// ---- What comes in: C-contiguous float64.
using Row = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Matrix4 = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;
using Matrices4 = nb::ndarray<const double, nb::shape<-1, 4, 4>, nb::c_contig, nb::device::cpu>;

/// @pre row.size() <= kMaxJoints
JointVector to_joints(const Row& row);
/// 16 numbers, row by row; refuses what is no rigid motion. `name` is for the message.
Pose to_pose(const double* T, const char* name);
/// s, finite and of at most 9e9
Time to_time(double seconds, const char* name);

// ---- What goes out: numpy arrays that own their memory.
/// The memory that `data` is set to is filled by the caller.
nb::object make_array(const std::vector<std::size_t>& shape, double*& data);
template <typename Vector>
nb::object from_vector(const Vector& vector) {
  double* data = nullptr;
  nb::object array = make_array({static_cast<std::size_t>(vector.size())}, data);
  for (int i = 0; i < static_cast<int>(vector.size()); ++i) data[i] = vector[i];
  return array;
}
inline nb::str to_text(std::string_view text) { return nb::str(text.data(), text.size()); }
void write_pose(const Vector3& p, const Matrix3& R, double* T);
nb::object from_pose(const Vector3& p, const Matrix3& R);

}  // namespace steadyhand::python
