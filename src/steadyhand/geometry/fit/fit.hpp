#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/fit/hull.hpp"
#include "steadyhand/geometry/robot/loading.hpp"

namespace steadyhand {

/// The geometry to fit bodies to, and how.
struct FitSettings {
  std::filesystem::path urdf;
  std::string tip;  ///< links of tools, see tools_on(); empty: the end of the longest chain
  std::map<std::string, std::vector<std::filesystem::path>>
      meshes;           ///< by link: instead of the URDF's, in its mesh's frame
  int most = 4;         ///< bodies of a URDF link
  bool boxes = true;    ///< besides spheres and capsules
  bool visual = false;  ///< use visual geometry even if there is collision geometry
  /// Accepts links that touch in every configuration, which nothing then keeps apart; false: such an arm is refused.
  bool touching = false;
  int rounds = 2;  ///< how often each link is fitted again, to the others' bodies
  std::uint32_t seed = 1;
  int judged = 100'000;  ///< configurations of FitResult::refused; 0: none
  std::function<void(const std::string& what, double fraction)> progress;  ///< fraction of the whole
};

/// One URDF link with geometry.
struct FittedLink {
  std::string link;
  int joined = 0;      ///< links behind its locked joints that are covered with it, where an arm has many
  std::string source;  ///< "collision", "visual", "files"
  std::size_t triangles = 0;
  std::vector<Hull> parts;  ///< convex, that hold the triangles; in the link's frame
  int spheres = 0, capsules = 0, boxes = 0;
  double hull = 0.0;   ///< m^3, of the convex hull
  double solid = 0.0;  ///< m^3, of the convex parts together
  double cover = 0.0;  ///< m^3, of the bodies together
};

/// A robot with bodies, and their cost in free space.
struct FitResult {
  /// Two links of the chain whose bodies overlap in free configurations.
  struct Blame {
    std::string first, second;
    int count = 0;  ///< configurations
  };

  RobotSettings robot;
  RobotModel model;  ///< of `robot`
  std::vector<FittedLink> links;
  std::vector<std::string> left_out;  ///< links that other movable joints carry, e.g. another arm on the same base
  /// Links that touch in every configuration, e.g. a shoulder in its torso's shell: nothing keeps them apart.
  std::vector<std::pair<std::string, std::string>> together;
  int candidates = 0;         ///< pairs of bodies that are not on the same link or on neighbours
  int always = 0, never = 0;  ///< candidates left out: overlap in every configuration; cannot come near
  int judged = 0, free = 0, refused = 0,
      missed =
          0;  ///< configurations: free by the convex parts, of these refused by the bodies; not free and called free
  std::vector<Blame> blame;  ///< links whose bodies refuse most of them, most first
};

/// Fits bodies to the geometry of a URDF, so that every triangle lies in them. Deterministic. In addition to
/// what load_robot refuses, it refuses meshes that load_mesh refuses (with the link's name) and arms without geometry.
Result<FitResult> fit_bodies(const FitSettings& settings);

/// Pairs that can come nearer than `margin` (m), or for which a limited search could not exclude it.
std::vector<BodyPair> pairs_that_meet(const RobotModel& model, const std::vector<BodyPair>& pairs, double margin);

/// Whether convex parts, as their corners in the frames of two links of the chain, can come nearer than `margin` (m),
/// or a limited search could not exclude it.
bool parts_may_meet(const RobotModel& model, int first, const std::vector<Points>& parts_of_first, int second,
                    const std::vector<Points>& parts_of_second, double margin);

/// The robot file. `command`: the command that made it, for its header.
std::string robot_file(const FitResult& result, const std::string& command, const std::filesystem::path& folder);
/// Table for users: a row per link, then the cost of the bodies.
std::string fit_table(const FitResult& result);
/// Front, side and top of the arm at home: convex parts and the outlines of its bodies.
std::string fit_picture(const FitResult& result);

}  // namespace steadyhand
