#include "steadyhand/geometry/mesh/mesh.hpp"

#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <fstream>

#include "steadyhand/core/text.hpp"

namespace steadyhand {

namespace {

constexpr double kLargest = 1e5;  // from the origin, m or, with a scale, mm

Vector3 color_of(const aiScene& scene, const aiMesh& mesh) {
  aiColor4D color(1.0f, 1.0f, 1.0f, 1.0f);
  if (mesh.mMaterialIndex < scene.mNumMaterials) {
    (void)aiGetMaterialColor(scene.mMaterials[mesh.mMaterialIndex], AI_MATKEY_COLOR_DIFFUSE, &color);
  }
  return Vector3(color.r, color.g, color.b).cwiseMax(0.0).cwiseMin(1.0);
}

/// Adds what a node and those below it show. False: too many triangles.
bool collect(const aiScene& scene, const aiNode& node, const aiMatrix4x4& above, std::size_t& count,
             std::vector<Painted>& parts) {
  const aiMatrix4x4 here = above * node.mTransformation;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[i]];
    Surface& surface = parts.emplace_back(Painted{color_of(scene, mesh), {}}).surface;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      Triangle triangle;
      for (int c = 0; c < 3; ++c) {
        if (face.mIndices[c] >= mesh.mNumVertices) return true;
        const aiVector3D corner = here * mesh.mVertices[face.mIndices[c]];
        triangle[c] = Vector3(corner.x, corner.y, corner.z);
      }
      if (count++ == kMaxTriangles) return false;
      surface.push_back(triangle);
    }
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) {
    if (!collect(scene, *node.mChildren[i], here, count, parts)) return false;
  }
  return true;
}

/// Cuts faces of more than three corners. Assimp's time for a face grows with the square of its corners.
Status triangulate(Assimp::Importer& importer, const std::filesystem::path& file) {
  constexpr double kMostWork = 1e8;  // corners squared, some seconds
  const aiScene& scene = *importer.GetScene();
  double work = 0.0;
  unsigned most = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const unsigned corners = mesh.mFaces[f].mNumIndices;
      if (corners > 4) work += static_cast<double>(corners) * corners;
      most = std::max(most, corners);
    }
  }
  if (work > kMostWork) {
    return Error{fmt::format("{} has faces of up to {} corners, too many to cut into triangles; save it as triangles",
                             file.string(), most)};
  }
  importer.ApplyPostProcessing(aiProcess_Triangulate);
  return Done{};
}

}  // namespace

Result<std::vector<Painted>> load_painted_mesh(const std::filesystem::path& file) {
  std::array<char, 64> begin{};
  std::ifstream(file, std::ios::binary).read(begin.data(), begin.size());
  if (is_lfs_pointer({begin.data(), begin.size()})) return Error{fmt::format("{} {}", file.string(), kLfsPointer)};
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = importer.ReadFile(file.string(), 0);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    return Error{fmt::format("{} cannot be read as a mesh: {}", file.string(),
                             scene == nullptr ? importer.GetErrorString() : "it has no scene")};
  }
  if (Status s = triangulate(importer, file); !s) return s.error();
  std::vector<Painted> parts;
  std::size_t count = 0;
  if (!collect(*scene, *scene->mRootNode, aiMatrix4x4(), count, parts)) {
    return Error{fmt::format("{} has more than {} triangles; reduce it", file.string(), kMaxTriangles)};
  }
  if (count == 0) return Error{fmt::format("{} has no triangles", file.string())};
  std::size_t triangle = 0;
  for (const Painted& part : parts) {
    for (const Triangle& corners : part.surface) {
      for (const Vector3& corner : corners) {
        if (corner.allFinite() && corner.norm() <= kLargest) continue;
        return Error{
            fmt::format("{}: triangle {} has a corner at [{}, {}, {}] m; it must be finite and within {} m; a "
                        "mesh in mm needs scale=\"0.001 0.001 0.001\" in the URDF",
                        file.string(), triangle, corner.x(), corner.y(), corner.z(), kLargest)};
      }
      ++triangle;
    }
  }
  return parts;
}

Result<Surface> load_mesh(const std::filesystem::path& file) {
  const Result<std::vector<Painted>> parts = load_painted_mesh(file);
  if (!parts) return parts.error();
  Surface surface;
  for (const Painted& part : *parts) surface.insert(surface.end(), part.surface.begin(), part.surface.end());
  return surface;
}

Surface box_surface(const Vector3& size) {
  Surface surface;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-0.5, 0.5}) {
      const auto corner = [&](double u, double v) {
        Vector3 at;
        at[axis] = side * size[axis];
        at[(axis + 1) % 3] = u * size[(axis + 1) % 3];
        at[(axis + 2) % 3] = v * size[(axis + 2) % 3];
        return at;
      };
      surface.push_back({corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5)});
      surface.push_back({corner(-0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)});
    }
  }
  return surface;
}

Surface cylinder_surface(double radius, double length) {
  constexpr int kSides = 64;
  const double outer = radius / std::cos(M_PI / kSides), top = 0.5 * length;
  Surface surface;
  for (int i = 0; i < kSides; ++i) {
    const double a = 2.0 * M_PI * i / kSides, b = 2.0 * M_PI * (i + 1) / kSides;
    const Vector3 p(outer * std::cos(a), outer * std::sin(a), 0.0), q(outer * std::cos(b), outer * std::sin(b), 0.0);
    const Vector3 up(0.0, 0.0, top);
    surface.push_back({p - up, q - up, q + up});
    surface.push_back({p - up, q + up, p + up});
    for (const double side : {-1.0, 1.0}) surface.push_back({side * up, p + side * up, q + side * up});
  }
  return surface;
}

Surface ball_surface(double radius) {
  Surface surface;
  for (int sign = 0; sign < 8; ++sign) {
    surface.push_back(
        {Vector3(sign & 1 ? 1 : -1, 0, 0), Vector3(0, sign & 2 ? 1 : -1, 0), Vector3(0, 0, sign & 4 ? 1 : -1)});
  }
  for (int round = 0; round < 4; ++round) {
    Surface finer;
    for (const auto& [a, b, c] : surface) {
      const Vector3 ab = (a + b).normalized(), bc = (b + c).normalized(), ca = (c + a).normalized();
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    surface = std::move(finer);
  }
  double inner = 1.0;  // radius of the ball within the faces' planes
  for (const auto& [a, b, c] : surface) inner = std::min(inner, std::abs((b - a).cross(c - a).normalized().dot(a)));
  for (Triangle& triangle : surface) {
    for (Vector3& corner : triangle) corner *= radius / inner;
  }
  return surface;
}

Surface moved(Surface surface, const Eigen::Affine3d& motion) {
  for (Triangle& triangle : surface) {
    for (Vector3& corner : triangle) corner = motion * corner;
  }
  return surface;
}

}  // namespace steadyhand
