#include "steadyhand/files/visual/arm_scene.hpp"

#include <fmt/format.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/robot_file.hpp"
#include "steadyhand/geometry/mesh/mesh.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"
#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kGrid = 0.0012;  // m; details below this cannot be seen from where the camera stands
constexpr std::size_t kMostTriangles = 100'000;

/// By link frame, then by colour (a hundredth each).
using Scene = std::map<int, std::map<std::array<int, 3>, Surface>>;

/// The triangles of a link's one colour.
struct Drawn {
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<std::uint32_t> corners;  ///< three of each triangle
};

/// Corners on a grid (m), one for each direction in which the surface looks there.
Drawn merged(const Surface& surface, double grid) {
  Drawn drawn;
  std::map<std::array<int, 6>, std::uint32_t> known;
  std::map<std::array<std::uint32_t, 3>, bool> seen;
  for (const Triangle& triangle : surface) {
    const Vector3 area = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    if (!(area.norm() > 0.0)) continue;
    const Vector3 normal = area.normalized();
    std::array<std::uint32_t, 3> corners;
    std::array<std::array<int, 3>, 3> cells;
    for (int c = 0; c < 3; ++c) {
      std::array<int, 6> key;
      for (int i = 0; i < 3; ++i) {
        key[i] = cells[c][i] = static_cast<int>(std::lround(triangle[c][i] / grid));
        key[3 + i] = static_cast<int>(std::lround(1.4 * normal[i]));
      }
      const auto [place, fresh] = known.emplace(key, static_cast<std::uint32_t>(drawn.positions.size()));
      if (fresh) {
        drawn.positions.emplace_back(grid * Vector3(key[0], key[1], key[2]).cast<float>());
        drawn.normals.emplace_back(Eigen::Vector3f::Zero());
      }
      corners[c] = place->second;
      drawn.normals[corners[c]] += area.cast<float>();
    }
    if (cells[0] == cells[1] || cells[1] == cells[2] || cells[2] == cells[0]) continue;
    std::array<std::uint32_t, 3> turned = corners;
    std::rotate(turned.begin(), std::min_element(turned.begin(), turned.end()), turned.end());
    if (seen.emplace(turned, true).second) drawn.corners.insert(drawn.corners.end(), corners.begin(), corners.end());
  }
  for (Eigen::Vector3f& normal : drawn.normals) {
    normal = normal.norm() > 0.0f ? normal.normalized().eval() : Eigen::Vector3f::UnitZ();
  }
  return drawn;
}

/// What one visual of a URDF shows, in its own frame.
Result<std::vector<Painted>> show(const urdf::Visual& visual, const fs::path& folder) {
  const Vector3 plain(0.8, 0.8, 0.82);
  std::vector<Painted> parts;
  if (const auto* mesh = dynamic_cast<const urdf::Mesh*>(visual.geometry.get())) {
    const auto file = find_mesh(folder, mesh->filename);
    if (!file) return Error{fmt::format("its mesh '{}' does not exist", mesh->filename)};
    Result<std::vector<Painted>> loaded = load_painted_mesh(*file);
    if (!loaded) return loaded;
    parts = *std::move(loaded);
    const Eigen::Affine3d scale(Eigen::Scaling(mesh->scale.x, mesh->scale.y, mesh->scale.z));
    for (Painted& part : parts) part.surface = moved(std::move(part.surface), scale);
  } else if (const auto* box = dynamic_cast<const urdf::Box*>(visual.geometry.get())) {
    parts.push_back({plain, box_surface({box->dim.x, box->dim.y, box->dim.z})});
  } else if (const auto* cylinder = dynamic_cast<const urdf::Cylinder*>(visual.geometry.get())) {
    parts.push_back({plain, cylinder_surface(cylinder->radius, cylinder->length)});
  } else if (const auto* sphere = dynamic_cast<const urdf::Sphere*>(visual.geometry.get())) {
    parts.push_back({plain, ball_surface(sphere->radius)});
  }
  if (visual.material && visual.material->texture_filename.empty()) {
    const urdf::Color& color = visual.material->color;
    const Vector3 named(color.r, color.g, color.b);
    if (named.maxCoeff() > 0.0) {
      for (Painted& part : parts) part.color = named.cwiseMax(0.0).cwiseMin(1.0);
    }
  }
  return parts;
}

/// Adds what an arm shows, in its base.
/// @param X_base_root where the URDF's root is @param links of other arms, behind which this one's are
Status add_scene(const fs::path& file, Xacro xacro, const UrdfChain& chain, const Eigen::Isometry3d& X_base_root,
                 int links, Scene& scene) {
  const Result<urdf::ModelInterfaceSharedPtr> model = read_urdf(file, xacro);
  if (!model) return model.error();
  std::error_code error;
  const fs::path folder = fs::absolute(file, error).parent_path();
  for (const auto& [name, link] : (*model)->links_) {
    const UrdfChain::Frame& frame = chain.frames.at(name);
    const Eigen::Isometry3d X = frame.link == 0 ? X_base_root * frame.X_link_frame : frame.X_link_frame;
    for (const urdf::VisualSharedPtr& visual : link->visual_array) {
      if (!visual->geometry) continue;
      Result<std::vector<Painted>> parts = show(*visual, folder);
      if (!parts) {
        return Error{
            fmt::format("{}: the visual geometry of link '{}': {}", file.string(), name, parts.error().message)};
      }
      const Eigen::Affine3d place(X * to_eigen(visual->origin));
      for (Painted& part : *parts) {
        const Surface placed = moved(std::move(part.surface), place);
        Surface& all = scene[frame.link == 0 ? 0 : links + frame.link][{
            static_cast<int>(std::lround(100.0 * part.color[0])), static_cast<int>(std::lround(100.0 * part.color[1])),
            static_cast<int>(std::lround(100.0 * part.color[2]))}];
        all.insert(all.end(), placed.begin(), placed.end());
      }
    }
  }
  return Done{};
}

/// A binary glTF 2.0 file as it grows.
class Gltf {
 public:
  int add_mesh(const Drawn& drawn, const std::array<int, 3>& color) {
    Eigen::Vector3f low = drawn.positions.front(), high = low;
    for (const Eigen::Vector3f& p : drawn.positions) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const auto list = [](const Eigen::Vector3f& v) { return Json::array({v[0], v[1], v[2]}); };
    const int positions = add(drawn.positions, "VEC3", kFloat, kVertices, drawn.positions.size());
    json_["accessors"][positions]["min"] = list(low);
    json_["accessors"][positions]["max"] = list(high);
    const int normals = add(drawn.normals, "VEC3", kFloat, kVertices, drawn.normals.size());
    const int corners = add(drawn.corners, "SCALAR", kUnsigned, kCorners, drawn.corners.size());
    json_["meshes"].push_back({{"primitives",
                                {{{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}},
                                  {"indices", corners},
                                  {"material", material(color)}}}}});
    json_["nodes"].push_back({{"mesh", json_["meshes"].size() - 1}});
    return static_cast<int>(json_["nodes"].size()) - 1;
  }

  void add_link(int link, const std::vector<int>& nodes) {
    json_["nodes"].push_back({{"name", fmt::format("link{}", link)}, {"children", nodes}});
    json_["scenes"][0]["nodes"].push_back(json_["nodes"].size() - 1);
  }

  std::string file() {
    json_["buffers"] = Json::array({{{"byteLength", blob_.size()}}});
    std::string text = json_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto total = static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + blob_.size());
    return "glTF" + number(2) + number(total) + number(text.size()) + "JSON" + text + number(blob_.size()) +
           std::string("BIN\0", 4) + blob_;
  }

 private:
  static constexpr int kFloat = 5126, kUnsigned = 5125, kVertices = 34962, kCorners = 34963;  // glTF's codes

  static std::string number(std::size_t value) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
    return bytes;
  }

  template <typename Items>
  int add(const Items& items, const char* type, int component, int target, std::size_t count) {
    const std::size_t bytes = items.size() * sizeof(items[0]);
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", blob_.size()}, {"byteLength", bytes}, {"target", target}});
    blob_.append(reinterpret_cast<const char*>(items.data()), bytes);
    json_["accessors"].push_back({{"bufferView", json_["bufferViews"].size() - 1},
                                  {"componentType", component},
                                  {"count", count},
                                  {"type", type}});
    return static_cast<int>(json_["accessors"].size()) - 1;
  }

  int material(const std::array<int, 3>& color) {
    const auto [known, fresh] = materials_.emplace(color, static_cast<int>(materials_.size()));
    if (fresh) {
      const auto linear = [](int hundredth) { return std::pow(hundredth / 100.0, 2.2); };
      json_["materials"].push_back({{"pbrMetallicRoughness",
                                     {{"baseColorFactor", {linear(color[0]), linear(color[1]), linear(color[2]), 1.0}},
                                      {"roughnessFactor", 0.5},
                                      {"metallicFactor", 0.1}}}});
    }
    return known->second;
  }

  Json json_ = {{"asset", {{"version", "2.0"}, {"generator", "steadyhand"}}},
                {"scene", 0},
                {"scenes", Json::array({{{"nodes", Json::array()}}})},
                {"nodes", Json::array()},
                {"meshes", Json::array()},
                {"materials", Json::array()},
                {"accessors", Json::array()},
                {"bufferViews", Json::array()}};
  std::string blob_;
  std::map<std::array<int, 3>, int> materials_;
};

}  // namespace

Result<std::string> arm_scene(const std::string& robot, const std::string& tip, const Places& places) {
  const Result<fs::path> file = find_named_file(places, "robots", robot);
  if (!file) return Error{"robot " + file.error().message};
  RobotSettings settings;
  settings.urdf = *file;
  settings.tools = tools_on(tip);
  if (file->extension() == ".yaml" || file->extension() == ".yml") {
    Result<RobotSettings> read = load_robot_settings(*file, places);
    if (!read) return read.error();
    settings = *std::move(read);
  }
  Scene scene;
  int links = 0;
  const auto add = [&](const RobotSettings& arm, const Eigen::Isometry3d& X_base_root) -> Status {
    const Result<UrdfChain> chain = read_urdf_chain(arm.urdf, links_of(arm.tools), arm.locked, arm.xacro);
    if (!chain) return chain.error();
    const Status status = add_scene(arm.urdf, arm.xacro, *chain, X_base_root, links, scene);
    links += static_cast<int>(chain->joints.size());
    return status;
  };
  if (settings.arms.empty()) {  // the page places the root
    if (Status s = add(settings, Eigen::Isometry3d::Identity()); !s) return s.error();
  }
  for (const RobotSettings& arm : settings.arms) {
    if (Status s = add(arm, arm.mount); !s) return s.error();
  }

  for (double grid = kGrid;; grid *= 1.5) {
    Gltf gltf;
    std::size_t triangles = 0;
    for (const auto& [link, surfaces] : scene) {
      std::vector<int> nodes;
      for (const auto& [color, surface] : surfaces) {
        const Drawn drawn = merged(surface, grid);
        if (drawn.corners.empty()) continue;
        triangles += drawn.corners.size() / 3;
        nodes.push_back(gltf.add_mesh(drawn, color));
      }
      if (!nodes.empty()) gltf.add_link(link, nodes);
    }
    if (triangles == 0) return std::string();
    if (triangles <= kMostTriangles || grid > 0.01) return gltf.file();
  }
}

}  // namespace steadyhand
