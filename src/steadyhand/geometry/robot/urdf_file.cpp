#include "steadyhand/geometry/robot/urdf_file.hpp"

#include <fmt/format.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <string>

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

/// urdfdom keeps the last of two parents silently and leaves loops that do not touch the root.
Status check_tree(const fs::path& file, const urdf::ModelInterface& model) {
  std::map<std::string, const urdf::Joint*> carried_by;
  for (const auto& [name, joint] : model.joints_) {
    const auto [first, inserted] = carried_by.emplace(joint->child_link_name, joint.get());
    if (!inserted) {
      return Error{fmt::format(
          "{}: link '{}' is the child of two joints, '{}' and '{}': the links form a loop; every link needs one parent",
          file.string(), joint->child_link_name, first->second->name, name)};
    }
  }
  for (const auto& [name, link] : model.links_) {
    std::string ancestor = name;
    for (std::size_t steps = 0; carried_by.contains(ancestor); ++steps) {
      if (steps > model.joints_.size()) {
        return Error{fmt::format("{}: link '{}' is part of, or hangs on, a loop of joints and never reaches root '{}'",
                                 file.string(), name, model.getRoot()->name)};
      }
      ancestor = carried_by.at(ancestor)->parent_link_name;
    }
  }
  return Done{};
}

/// Breaks the ownership cycles that a loop makes, so that a refused model is freed.
void take_apart(urdf::ModelInterface& model) {
  for (const auto& [name, link] : model.links_) {
    link->child_links.clear();
    link->child_joints.clear();
  }
}

Status check_meshes(const fs::path& file, const urdf::ModelInterface& model) {
  std::error_code error;
  const fs::path folder = fs::absolute(file, error).parent_path();
  const auto check = [&](const std::string& link, const char* use, const urdf::Geometry* geometry) -> Status {
    const auto* mesh = dynamic_cast<const urdf::Mesh*>(geometry);
    if (mesh == nullptr || find_mesh(folder, mesh->filename)) return Done{};
    return Error{fmt::format("{}: the {} mesh '{}' of link '{}' does not exist (looked for it from {})", file.string(),
                             use, mesh->filename, link, folder.string())};
  };
  for (const auto& [name, link] : model.links_) {
    for (const auto& visual : link->visual_array) {
      if (Status status = check(name, "visual", visual->geometry.get()); !status) return status;
    }
    for (const auto& collision : link->collision_array) {
      if (Status status = check(name, "collision", collision->geometry.get()); !status) return status;
    }
  }
  return Done{};
}

/// Decodes a URI: %20 is a space.
std::string percent_decoded(const std::string& name) {
  const auto is_hex = [&](std::size_t i) {
    return i < name.size() && std::isxdigit(static_cast<unsigned char>(name[i])) != 0;
  };
  std::string decoded;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] == '%' && is_hex(i + 1) && is_hex(i + 2)) {
      decoded += static_cast<char>(std::stoi(name.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      decoded += name[i];
    }
  }
  return decoded;
}

std::optional<fs::path> find_mesh_as_written(const fs::path& folder, const std::string& name) {
  const auto existing = [](const fs::path& path) -> std::optional<fs::path> {
    std::error_code error;
    if (fs::is_regular_file(path, error)) return path;
    return std::nullopt;
  };
  if (name.starts_with("file://")) return existing(folder / name.substr(7));
  if (!name.starts_with("package://")) return existing(folder / name);
  const std::string inside = name.substr(10),
                    in_package = inside.substr(std::min(inside.find('/'), inside.size() - 1) + 1);
  for (const std::string& path : {inside, in_package}) {  // the package may have been copied under another name
    for (fs::path above = folder;; above = above.parent_path()) {
      if (const auto found = existing(above / path)) return found;
      if (above == above.parent_path()) break;
    }
  }
  return std::nullopt;
}

}  // namespace

Eigen::Isometry3d to_eigen(const urdf::Pose& pose) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Quaternion(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z).normalized().matrix();
  T.translation() = Vector3(pose.position.x, pose.position.y, pose.position.z);
  return T;
}

std::optional<fs::path> find_mesh(const fs::path& folder, const std::string& name) {
  if (const auto found = find_mesh_as_written(folder, name)) return found;
  const std::string decoded = percent_decoded(name);
  return decoded == name ? std::nullopt : find_mesh_as_written(folder, decoded);
}

Result<urdf::ModelInterfaceSharedPtr> read_urdf(const fs::path& file, Xacro xacro, std::vector<UnreadElement>* unread) {
  const Result<UrdfText> text = read_urdf_text(file, xacro);
  if (!text) return text.error();
  std::vector<UnreadElement> found;
  Result<urdf::ModelInterfaceSharedPtr> model = parse_urdf(file, *text, found);
  if (!model) return model;
  if (unread != nullptr) *unread = std::move(found);
  if (Status status = check_tree(file, **model); !status) {
    take_apart(**model);
    return status.error();
  }
  if (Status status = check_meshes(file, **model); !status) return status.error();
  return model;
}

}  // namespace steadyhand
