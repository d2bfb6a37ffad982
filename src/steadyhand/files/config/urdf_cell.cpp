#include <fmt/format.h>
#include <urdf_model/joint.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include "steadyhand/files/config/cell_formats.hpp"
#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

Result<Shape> shape_of(const urdf::Geometry& geometry) {
  switch (geometry.type) {
    case urdf::Geometry::SPHERE:
      return Shape::sphere(static_cast<const urdf::Sphere&>(geometry).radius);
    case urdf::Geometry::BOX: {
      const urdf::Vector3& size = static_cast<const urdf::Box&>(geometry).dim;
      return Shape::box({0.5 * size.x, 0.5 * size.y, 0.5 * size.z});
    }
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
      return Shape::cylinder(cylinder.radius, 0.5 * cylinder.length);
    }
    default:
      return Error{"is a mesh, which is not read: give boxes, spheres or cylinders"};
  }
}

/// A link's solids, and those of the links that hang on it.
Status add_link(const std::string& file, const urdf::Link& link, const Eigen::Isometry3d& X_base_link, Cell& cell) {
  int count = 0;
  for (const urdf::CollisionSharedPtr& collision : link.collision_array) {
    ++count;
    const auto refuse = [&](const std::string& reason) {
      return Error{fmt::format("{}: collision {} of link '{}' {}", file, count, link.name, reason)};
    };
    if (!collision || !collision->geometry) return refuse("has no geometry");
    const Result<Shape> shape = shape_of(*collision->geometry);
    if (!shape) return refuse(shape.error().message);
    CellObject& object = cell.objects.emplace_back();
    object.name = link.name;
    object.shape = *shape;
    object.origin = X_base_link * to_eigen(collision->origin);
  }
  for (const urdf::LinkSharedPtr& child : link.child_links) {
    const urdf::Joint& joint = *child->parent_joint;
    if (joint.type != urdf::Joint::FIXED) {
      return Error{fmt::format("{}: joint '{}' is not fixed; a cell must be stationary", file, joint.name)};
    }
    const Eigen::Isometry3d X = X_base_link * to_eigen(joint.parent_to_joint_origin_transform);
    if (Status s = add_link(file, *child, X, cell); !s) return s;
  }
  return Done{};
}

}  // namespace

Result<Cell> load_urdf_cell(const std::filesystem::path& file) {
  const auto model = read_urdf(file, Xacro::kNever);  // a cell may come from anybody
  if (!model) return model.error();
  Cell cell;
  cell.name = file.stem().string();
  const Status added = add_link(file.string(), *(*model)->getRoot(), Eigen::Isometry3d::Identity(), cell);
  if (!added) return added.error();
  if (cell.objects.empty())
    return Error{fmt::format("{}: no link has a <collision>, so the cell would have no obstacles", file.string())};
  return cell;
}

}  // namespace steadyhand
