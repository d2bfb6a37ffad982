#include "steadyhand/geometry/fit/link_geometry.hpp"

#include <fmt/format.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRows = 20;  // links that are covered each for itself

bool positive(double size) { return std::isfinite(size) && size > 0.0; }

/// Whether a joint that is not of the chain moves the link against the base.
bool moves_elsewhere(const urdf::Link& link, const UrdfChain& chain) {
  if (chain.frames.at(link.name).link != 0) return false;
  for (const urdf::Link* at = &link; at && at->parent_joint; at = at->getParent().get()) {
    if (at->parent_joint->type != urdf::Joint::FIXED) return true;
  }
  return false;
}

/// The link on the same part of the chain that holds this one through locked joints; itself if there are none.
const urdf::Link& holder_of(const urdf::Link& link, const UrdfChain& chain) {
  const urdf::Link* holder = &link;
  for (const urdf::Link* at = &link; at->parent_joint; at = at->getParent().get()) {
    const urdf::Link* parent = at->getParent().get();
    if (!parent || chain.frames.at(parent->name).link != chain.frames.at(link.name).link) break;
    if (at->parent_joint->type != urdf::Joint::FIXED) holder = parent;
  }
  return *holder;
}

}  // namespace

Result<LinkGeometry> LinkReader::read(const urdf::Link& link) {
  if (const auto given = settings_.meshes.find(link.name); given != settings_.meshes.end()) {
    return read_files(link, given->second);
  }
  LinkGeometry geometry;
  bool whole = true;
  const auto add = [&](const auto& elements, const char* use) -> Status {
    for (const auto& element : elements) {
      if (!element->geometry) continue;
      if (Status s = add_element(link.name, use, *element->geometry, to_eigen(element->origin), geometry, whole); !s)
        return s;
    }
    if (!elements.empty()) geometry.source = use;
    return Done{};
  };
  if (!settings_.visual || link.visual_array.empty()) {
    if (Status s = add(link.collision_array, "collision"); !s) return s.error();
  }
  if (geometry.pieces.empty()) {
    if (Status s = add(link.visual_array, "visual"); !s) return s.error();
  }
  if (!whole || static_cast<int>(geometry.exact.size()) > settings_.most) geometry.exact.clear();
  return geometry;
}

Result<LinkGeometry> LinkReader::read_files(const urdf::Link& link, const std::vector<fs::path>& files) {
  LinkGeometry geometry;
  geometry.source = "files";
  Eigen::Affine3d placed = Eigen::Affine3d::Identity();
  const auto first_mesh = [&](const auto& elements) {
    for (const auto& element : elements) {
      const auto* mesh = dynamic_cast<const urdf::Mesh*>(element->geometry.get());
      if (mesh == nullptr) continue;
      placed = to_eigen(element->origin) * Eigen::Scaling(mesh->scale.x, mesh->scale.y, mesh->scale.z);
      return true;
    }
    return false;
  };
  if (!first_mesh(link.visual_array)) (void)first_mesh(link.collision_array);
  for (const fs::path& file : files) {
    std::error_code error;
    const fs::path path = fs::exists(file, error) ? file : folder_ / file;
    Result<Surface> surface = load_mesh(path);
    if (!surface) return Error{fmt::format("link '{}': {}", link.name, surface.error().message)};
    geometry.pieces.push_back(moved(*std::move(surface), placed));
  }
  return geometry;
}

Status LinkReader::add_element(const std::string& link, const char* use, const urdf::Geometry& shape,
                               const Eigen::Isometry3d& origin, LinkGeometry& geometry, bool& whole) {
  const auto refuse = [&](const std::string& reason) {
    return Error{fmt::format("{}: the {} geometry of link '{}': {}", settings_.urdf.string(), use, link, reason)};
  };
  if (!origin.matrix().allFinite()) return refuse("its origin holds a number that is not finite");
  if (const auto* sphere = dynamic_cast<const urdf::Sphere*>(&shape)) {
    if (!positive(sphere->radius)) return refuse(fmt::format("its radius is {} m", sphere->radius));
    geometry.pieces.push_back(moved(ball_surface(sphere->radius), origin));
    geometry.exact.push_back({Shape::sphere(sphere->radius), origin});
  } else if (const auto* box = dynamic_cast<const urdf::Box*>(&shape)) {
    const Vector3 size(box->dim.x, box->dim.y, box->dim.z);
    if (!positive(size.x()) || !positive(size.y()) || !positive(size.z())) {
      return refuse(fmt::format("its size is [{}, {}, {}] m", size.x(), size.y(), size.z()));
    }
    geometry.pieces.push_back(moved(box_surface(size), origin));
    geometry.exact.push_back({Shape::box(0.5 * size), origin});
    whole = whole && settings_.boxes;
  } else if (const auto* cylinder = dynamic_cast<const urdf::Cylinder*>(&shape)) {
    if (!positive(cylinder->radius) || !positive(cylinder->length)) {
      return refuse(fmt::format("its radius is {} m, its length {} m", cylinder->radius, cylinder->length));
    }
    geometry.pieces.push_back(moved(cylinder_surface(cylinder->radius, cylinder->length), origin));
    whole = false;
  } else if (const auto* mesh = dynamic_cast<const urdf::Mesh*>(&shape)) {
    const auto found = find_mesh(folder_, mesh->filename);
    if (!found) return refuse(fmt::format("its mesh '{}' does not exist", mesh->filename));
    Result<Surface> surface = load_mesh(*found);
    if (!surface) return refuse(surface.error().message);
    const Vector3 scale(mesh->scale.x, mesh->scale.y, mesh->scale.z);
    if (!scale.allFinite() || scale.cwiseAbs().minCoeff() <= 0.0) {
      return refuse(fmt::format("its scale is [{}, {}, {}]", scale.x(), scale.y(), scale.z()));
    }
    geometry.pieces.push_back(moved(*std::move(surface), origin * Eigen::Scaling(scale)));
    whole = false;
  }
  return Done{};
}

Status check_unread(const urdf::ModelInterface& urdf, const std::vector<UnreadElement>& unread,
                    const FitSettings& settings) {
  for (const UnreadElement& each : unread) {
    const urdf::LinkConstSharedPtr link = urdf.getLink(each.link);
    const bool covered = settings.visual || (link && link->collision_array.empty());
    if (each.element != "visual" || !covered || settings.meshes.contains(each.link)) continue;
    return Error{fmt::format("{}: the <visual> of link '{}' cannot be read: {}; no body would cover it", each.where,
                             each.link, each.reason)};
  }
  return Done{};
}

Status check_size(const FitSettings& settings, const urdf::Link& link, const LinkGeometry& geometry,
                  const UrdfChain& chain) {
  constexpr double kLongest = 5.0, kHall = 1000.0;  // m, and so many times as long as the arm; what does not move
  double arm = 0.0;
  for (const Joint& joint : chain.joints) arm += joint.origin.translation().norm();
  Eigen::AlignedBox3d box;
  for (const Surface& piece : geometry.pieces) {
    for (const Triangle& triangle : piece) {
      for (const Vector3& corner : triangle) box.extend(corner);
    }
  }
  const double length = box.sizes().maxCoeff();
  if (length <= (chain.frames.at(link.name).link == 0 ? kHall : kLongest * std::max(1.0, arm))) return Done{};
  return Error{
      fmt::format("{}: the {} geometry of link '{}' is {:.4g} m long, the joints of the whole arm are {:.3g} m apart. "
                  "Is it in mm? A URDF has m: give a mesh in mm scale=\"0.001 0.001 0.001\"",
                  settings.urdf.string(), geometry.source, link.name, length, arm)};
}

std::vector<std::vector<const urdf::Link*>> group_links(const urdf::ModelInterface& urdf, const UrdfChain& chain,
                                                        const FitSettings& settings,
                                                        std::vector<std::string>& left_out) {
  std::vector<const urdf::Link*> links;
  for (const auto& [name, link] : urdf.links_) {
    if (link->collision_array.empty() && link->visual_array.empty() && settings.meshes.count(name) == 0) continue;
    links.push_back(link.get());
  }
  const bool each = links.size() <= kMostRows;
  std::erase_if(links, [&](const urdf::Link* link) {
    const bool out = !each && moves_elsewhere(*link, chain);
    if (out) left_out.push_back(link->name);
    return out;
  });
  std::stable_sort(links.begin(), links.end(), [&](const urdf::Link* a, const urdf::Link* b) {
    return chain.frames.at(a->name).link < chain.frames.at(b->name).link;
  });
  std::vector<std::vector<const urdf::Link*>> rows;
  for (const urdf::Link* link : links) {
    const urdf::Link* holder = each ? link : &holder_of(*link, chain);
    const auto known = std::find_if(rows.begin(), rows.end(), [&](const auto& row) { return row[0] == holder; });
    if (known != rows.end()) {
      if (link != holder) known->push_back(link);
    } else {
      rows.push_back({holder});
      if (link != holder) rows.back().push_back(link);
    }
  }
  return rows;
}

}  // namespace steadyhand
