#include "steadyhand/geometry/fit/fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "geometry/robot/random_arm.hpp"
#include "geometry/robot/urdf_text.hpp"
#include "steadyhand/geometry/fit/cover.hpp"
#include "steadyhand/geometry/fit/pieces.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

Points cube(double half) {
  Points corners;
  for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half);
  return corners;
}

TEST(Hull, LeavesOutWhatIsInsideAndTwice) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-0.99, 0.99);
  Points points = cube(1.0);
  for (int i = 0; i < 500; ++i) points.emplace_back(anywhere(random), anywhere(random), anywhere(random));
  const Points once = points;
  points.insert(points.end(), once.begin(), once.end());
  const Hull hull = convex_hull(points);
  EXPECT_NEAR(hull.volume, 8.0, 1e-4);
  EXPECT_EQ(hull.corners.size(), 8u);
  for (const Triangle& t : hull.faces) {
    const Vector3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
    for (const Vector3& p : once) EXPECT_LE(normal.dot(p - t[0]), 1e-4);
  }
}

TEST(Hull, OfFlatAndFewPointsIsNoCrash) {
  EXPECT_TRUE(convex_hull({}).corners.empty());
  EXPECT_EQ(convex_hull({Vector3::Ones(), Vector3::Ones()}).corners.size(), 1u);
  EXPECT_LT(convex_hull({Vector3::Zero(), Vector3::UnitX(), Vector3::UnitY(), Vector3(1, 1, 0)}).volume, 1e-4);
}

TEST(ConvexParts, OfAnAngleAreItsLegs) {
  Surface angle = moved(box_surface({1.0, 0.1, 0.1}), Eigen::Affine3d(Eigen::Translation3d(0.45, 0.0, 0.0)));
  const Surface leg = moved(box_surface({0.1, 1.0, 0.1}), Eigen::Affine3d(Eigen::Translation3d(0.0, 0.45, 0.0)));
  angle.insert(angle.end(), leg.begin(), leg.end());
  double volume = 0.0;
  const std::vector<Hull> parts = convex_parts({angle}, 10, 0.004);
  for (const Hull& part : parts) volume += part.volume;
  EXPECT_GE(parts.size(), 2u);
  EXPECT_LT(volume, 0.025);  // 0.019 is the angle's own, 0.0595 that of its hull
}

TEST(NearestPoints, OfCubesAreThoseOfPlanesAndCorners) {
  const Points unit = cube(1.0);
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.translation() = Vector3(3.0, 0.5, 0.2);
  EXPECT_NEAR(nearest_points(unit, unit, motion, 10.0).distance, 1.0, 1e-9);
  EXPECT_GT(nearest_points(unit, unit, motion, 0.5).distance, 0.5);  // stops early
  motion.translation() = Vector3(3.0, 3.0, 3.0);
  const Nearest corners = nearest_points(unit, unit, motion, 10.0);
  EXPECT_NEAR(corners.distance, std::sqrt(3.0), 1e-9);
  EXPECT_NEAR((corners.first - Vector3::Ones()).norm(), 0.0, 1e-6);
  EXPECT_NEAR((corners.second - Vector3::Constant(2.0)).norm(), 0.0, 1e-6);
  motion.translation() = Vector3(1.0, 0.3, 0.1);
  EXPECT_EQ(nearest_points(unit, unit, motion, 10.0).distance, 0.0);
}

TEST(Prove, GrowsUntilEachPieceIsHeld) {
  const Surface plate = box_surface({0.4, 0.1, 0.02});
  std::vector<FittedSolid> solids(2);
  for (int i = 0; i < 2; ++i) {
    solids[i].shape = Shape::sphere(0.05);
    solids[i].origin.translation().x() = i == 0 ? -0.1 : 0.1;
  }
  EXPECT_FALSE(is_covered(plate, solids));
  prove(plate, solids);
  EXPECT_TRUE(is_covered(plate, solids));
  EXPECT_LT(solids[0].shape.radius, 0.13);
  for (FittedSolid& solid : solids) {
    solid.shape.radius -= 1e-3;
    EXPECT_FALSE(is_covered(plate, solids));
    solid.shape.radius += 1e-3;
  }
}

TEST(Cover, OfALineAndOfNeedlesHasFewPieces) {
  for (const auto& [height, count] : {std::pair(0.0, 20), {1e-6, 20}, {1e-4, 20}, {0.0, 10000}}) {
    Surface line;
    for (int i = 0; i < count; ++i) {
      line.push_back({Vector3(0, 0, 0), Vector3(0, 0, 1.0), Vector3(height, 0, 0.8 * i / count)});
    }
    std::vector<CoverProbe> probes;  // all along it
    for (int i = -2; i <= 12; ++i) {
      for (const double side : {-1.0, 1.0}) {
        probes.push_back({Vector3(0.05 * side, 0.0, 0.1 * i), 0.05, 0.01, 0.05, 0.1});
        probes.push_back({Vector3(0.0, 0.05 * side, 0.1 * i), 0.05, 0.01, 0.05, 0.1});
      }
    }
    CoverSettings settings;
    settings.most = 1;
    const Cover found = cover(line, probes, settings);
    EXPECT_TRUE(is_covered(line, found.solids)) << height;
  }
}

/// It is neither flat enough to be a line nor high enough for few halves.
TEST(SmallTriangles, OfASliverAreFew) {
  for (const double height : {1e-4, 1e-5, 1e-6}) {
    const Surface sliver = {{Vector3(0, 0, 0), Vector3(2, 0, 0), Vector3(0, height, 0)}};
    EXPECT_LT(small_triangles(sliver).triangles.size(), 100'000u) << height;
  }
}

TEST(LoadMesh, RefusesAFaceOfVeryManyCorners) {
  const TemporaryFolder folder;
  for (const int corners : {300, 20000}) {
    std::ofstream file(folder.path() / "disc.obj");
    std::string face = "f";
    for (int i = 1; i <= corners; ++i) {
      const double angle = 2.0 * M_PI * i / corners;
      file << "v " << std::cos(angle) << " " << std::sin(angle) << " 0\n";
      face += " " + std::to_string(i);
    }
    file << face << "\n";
    file.close();
    const Result<Surface> disc = load_mesh(folder.path() / "disc.obj");
    ASSERT_EQ(bool(disc), corners == 300);
    if (disc) {
      EXPECT_EQ(disc->size(), 298u);
    } else {
      EXPECT_NE(disc.error().message.find("disc.obj has faces of up to 20000 corners"), std::string::npos)
          << disc.error().message;
    }
  }
}

TEST(Cover, IsReadAsItIsWritten) {
  FittedSolid solid{Shape::capsule(0.1, 0.03)};
  solid.origin = Eigen::Isometry3d(Eigen::Translation3d(0.1, 0.2, 0.3)) * Eigen::AngleAxisd(0.4, Vector3::UnitY());
  const FittedSolid once = rounded(solid);
  EXPECT_EQ(as_written(once), as_written(rounded(once)));
  EXPECT_NEAR(once.shape.core.z(), 0.1, 2e-5);
  solid.shape = Shape::box({0.1, 0.05, 0.02}, 0.01);
  EXPECT_EQ(as_written(rounded(solid)), as_written(rounded(rounded(solid))));
}

/// Links 0 to 2 along x, 1 m each, that turn about z; a ball at the base and one at the end, `offset` aside along z.
RobotModel planar_arm(double offset) {
  RobotModel model;
  for (int k = 0; k < 2; ++k) {
    Joint joint;
    joint.origin.translation() = Vector3(1.0, 0.0, 0.0);
    model.joints.push_back(joint);
  }
  model.position_min = JointVector::Constant(2, -M_PI);
  model.position_max = JointVector::Constant(2, M_PI);
  model.bodies = {Body::sphere("base", 0, Vector3::Zero(), 0.1),
                  Body::sphere("end", 2, Vector3(0.0, 0.0, offset), 0.1)};
  return model;
}

TEST(PairsThatMeet, LeavesOutOnlyWhatCannot) {
  // The second joint is 1 m from the first, which is 1 m from the base's ball: it can meet that ball, if not next to
  // it.
  EXPECT_EQ(pairs_that_meet(planar_arm(0.0), {{0, 1}}, 0.02).size(), 1u);
  EXPECT_EQ(pairs_that_meet(planar_arm(0.21), {{0, 1}}, 0.02).size(), 1u);
  EXPECT_EQ(pairs_that_meet(planar_arm(0.35), {{0, 1}}, 0.02).size(), 0u);
}

/// Its bounds hold along ways that go towards the base and away from it.
TEST(PairsThatMeet, KeepsWhatRandomTreesBringNear) {
  std::mt19937 random(5);
  int left_out = 0;
  for (int tree = 0; tree < 6; ++tree) {
    RobotModel model = random_tree(tree % 3, 1 + tree % 2, 2, random);
    model.position_min *= 0.1;
    model.position_max *= 0.1;
    const std::vector<BodyPair> near = pairs_that_meet(model, model.pairs, 0.02);
    std::vector<BodyPair> far = model.pairs;
    std::erase_if(far, [&](const BodyPair& pair) { return std::count(near.begin(), near.end(), pair) > 0; });
    left_out += static_cast<int>(far.size());
    Kinematics kinematics(model);
    for (int s = 0; s < 2000; ++s) {
      kinematics.set_position(random_joints(model.dof(), 0.1 * M_PI, random));
      for (const BodyPair& pair : far) ASSERT_GE(gap(kinematics, pair), 0.02);
    }
  }
  EXPECT_GT(left_out, 50);
}

/// A block on the base, and a cube on the arm's second link that can come over it, so high above: of balls around them
/// nothing could be shown.
TEST(PartsMayMeet, NotWhereFacesStayApart) {
  const auto block = [](const Vector3& center, const Vector3& half) {
    Points corners;
    for (int i = 0; i < 8; ++i)
      corners.push_back(center + half.cwiseProduct(Vector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
    return corners;
  };
  const Points base = block(Vector3::Zero(), {0.1, 0.1, 0.1});
  const auto meets = [&](double z, double margin) {
    return parts_may_meet(planar_arm(0.0), 0, {base}, 2, {block({0.0, 0.0, z}, {0.02, 0.02, 0.02})}, margin);
  };
  EXPECT_TRUE(meets(0.0, 1e-3));
  EXPECT_TRUE(meets(0.12, 1e-3)) << "faces on each other";
  EXPECT_FALSE(meets(0.13, 1e-3));
  EXPECT_TRUE(meets(0.13, 0.02));
  EXPECT_TRUE(meets(0.1215, 1e-3)) << "too near to be shown within its steps";
}

/// An arm of one joint, 0.3 m from its base, whose link has this text.
std::string refusal_of_link(const std::string& text, bool visual = false) {
  const TemporaryFolder folder;
  folder.write("lfs.stl", "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n");
  folder.write("mm.stl",
               "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 120 0 0\nvertex 0 80 0\nendloop\n"
               "endfacet\nendsolid a\n");
  FitSettings settings;
  settings.urdf = folder.write(
      "arm.urdf", urdf_robot(urdf_link("l0") + urdf_link("l1", text) + urdf_joint("j1", "revolute", "l0", "l1")));
  settings.visual = visual;
  settings.rounds = settings.judged = 0;
  const Result<FitResult> result = fit_bodies(settings);
  return result ? "" : result.error().message;
}

TEST(FitBodies, NamesAGitLfsPointer) {
  const std::string said = refusal_of_link("<collision><geometry><mesh filename='lfs.stl'/></geometry></collision>");
  EXPECT_NE(said.find("lfs.stl is a Git LFS pointer, not the file itself: run `git lfs pull`"), std::string::npos)
      << said;
}

TEST(FitBodies, AsksForTheUnitOfAMeshThatIsLargerThanTheArm) {
  const std::string said = refusal_of_link("<visual><geometry><mesh filename='mm.stl'/></geometry></visual>");
  EXPECT_NE(said.find("the visual geometry of link 'l1' is 120 m long, the joints of the whole arm are 0.3 m apart"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("scale=\"0.001 0.001 0.001\""), std::string::npos) << said;
}

TEST(FitBodies, LeavesNoPartOfALinkWithoutABody) {
  const std::string bad = "<visual><origin xyz='0 0'/><geometry><sphere radius='1'/></geometry></visual>";
  const std::string said = refusal_of_link(bad);
  EXPECT_NE(said.find("arm.urdf:4: the <visual> of link 'l1' cannot be read"), std::string::npos) << said;
  const std::string good = "<collision><geometry><sphere radius='0.1'/></geometry></collision>";
  EXPECT_NE(refusal_of_link(bad + good, true).find("<visual>"), std::string::npos);
  EXPECT_EQ(refusal_of_link(bad + good).find("<visual>"), std::string::npos);
}

TEST(FitBodies, CoversBothArmsOfATree) {
  const std::string rod =
      "<collision><origin xyz='0.15 0 0'/><geometry><box size='0.2 0.05 0.05'/></geometry></collision>";
  const TemporaryFolder folder;
  FitSettings settings;
  settings.urdf = folder.write("arm.urdf", urdf_robot(urdf_two_arms(1, 2, 3, rod)));
  settings.tip = "left_2,right_3";
  settings.rounds = 0;
  settings.judged = 2000;
  const Result<FitResult> result = fit_bodies(settings);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->links.size(), 5u);
  EXPECT_TRUE(result->left_out.empty());
  EXPECT_EQ(result->missed, 0);
  const RobotModel& model = result->model;
  for (const BodyPair& pair : model.pairs)
    EXPECT_GT(way_between(model, model.bodies[pair.first].link, model.bodies[pair.second].link).size(), 1u);
  const std::string text = robot_file(*result, "fit", folder.path());
  EXPECT_NE(text.find("tools:\n  left_2:\n    link: left_2\n"), std::string::npos) << text;
  const Result<RobotModel> again = load_robot(result->robot);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->pairs, model.pairs);
}

}  // namespace
}  // namespace steadyhand
