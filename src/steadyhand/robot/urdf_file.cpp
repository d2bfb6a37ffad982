#include "steadyhand/robot/urdf_file.hpp"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "steadyhand/robot/xacro.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

/// Collects what urdfdom would print. urdfdom's handler is one for the whole process, hence the lock.
class Messages : public console_bridge::OutputHandler {
 public:
  Messages() : lock_(mutex_) { console_bridge::useOutputHandler(this); }
  ~Messages() override { console_bridge::restorePreviousOutputHandler(); }

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    if (!text_.empty()) text_ += "; ";
    for (const char c : text) text_ += c == '\n' ? ' ' : c;
  }
  const std::string& text() const { return text_; }

 private:
  static inline std::mutex mutex_;
  std::lock_guard<std::mutex> lock_;
  std::string text_;
};

Result<std::string> read_text(const fs::path& file) {
  std::error_code error;
  if (file.empty()) return Error{"the path of the URDF is empty"};
  if (!fs::exists(file, error)) return Error{fmt::format("{}: no such file", file.string())};
  if (!fs::is_regular_file(file, error)) return Error{fmt::format("{} is not a file", file.string())};
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return Error{fmt::format("{} cannot be read", file.string())};
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    return Error{fmt::format("{} is empty: a URDF was expected", file.string())};
  }
  return text;
}

/// How deep elements stand inside each other, roughly: urdfdom's XML parser recurses, and would take minutes or
/// overflow the stack where a URDF needs a handful.
int nesting_depth(std::string_view text) {
  int depth = 0, deepest = 0;
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text.substr(i, 4) == "<!--") {
      i = text.find("-->", i);
      if (i == std::string_view::npos) break;
    } else if (text.substr(i, 2) == "</" || text.substr(i, 2) == "/>") {
      --depth;
    } else if (text[i] == '<' && text[i + 1] != '?' && text[i + 1] != '!') {
      deepest = std::max(deepest, ++depth);
    }
  }
  return deepest;
}

Result<urdf::ModelInterfaceSharedPtr> parse(const fs::path& file, const std::string& text) {
  constexpr int kMaxDepth = 100;
  if (const int depth = nesting_depth(text); depth > kMaxDepth) {
    return Error{fmt::format("{} is not a usable URDF: its elements stand {} deep inside each other, {} is the most",
                             file.string(), depth, kMaxDepth)};
  }
  Messages messages;
  urdf::ModelInterfaceSharedPtr model;
  std::string reason;
  try {
    model = urdf::parseURDF(text);
  } catch (const std::exception& exception) {
    reason = exception.what();
  }
  // What it cannot read of a link's solids it leaves out; nothing would be kept clear of that.
  constexpr std::string_view kLeftOut = "Could not parse collision element";
  if (model && messages.text().find(kLeftOut) != std::string::npos) {
    return Error{fmt::format("{}: {}: a <collision> needs a <geometry> with its sizes, and finite numbers",
                             file.string(), messages.text())};
  }
  if (model) return model;
  if (!messages.text().empty()) reason = messages.text();
  if (reason.empty()) reason = "not well-formed XML";
  return Error{fmt::format(
      "{} is not a usable URDF: {} (a URDF is XML, <robot> at the top, whose links form one tree: one root, no loop)",
      file.string(), reason)};
}

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

}  // namespace

Eigen::Isometry3d to_eigen(const urdf::Pose& pose) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Quaternion(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z).normalized().matrix();
  T.translation() = Vector3(pose.position.x, pose.position.y, pose.position.z);
  return T;
}

std::optional<fs::path> find_mesh(const fs::path& folder, const std::string& name) {
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

Result<urdf::ModelInterfaceSharedPtr> read_urdf(const fs::path& file) {
  Result<std::string> text = read_text(file);
  if (text && text->find("<xacro:") != std::string::npos) text = expand_xacro(file);
  if (!text) return text.error();
  Result<urdf::ModelInterfaceSharedPtr> model = parse(file, *text);
  if (!model) return model;
  if (Status status = check_tree(file, **model); !status) {
    take_apart(**model);
    return status.error();
  }
  if (Status status = check_meshes(file, **model); !status) return status.error();
  return model;
}

}  // namespace steadyhand
