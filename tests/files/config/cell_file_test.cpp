#include "steadyhand/files/config/cell_file.hpp"

#include <gtest/gtest.h>

#include "files/config/refusal.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

constexpr const char* kExample = R"(margin: 0.02
objects:
  - {name: table, half_space: {point: [0, 0, -0.1]}}
  - {name: wall, half_space: {point: [0.9, 0, 0], normal: [-2, 0, 0]}, margin: 0}
  - {name: box, box: {size: [0.3, 0.2, 0.2], center: [0.6, 0.3, 0.1], rpy: [0, 0, 0.5]}, margin: 0.03, color: "#c28F5c"}
  - {name: post, cylinder: {from: [0.4, -0.4, 0], to: [0.4, -0.4, 0.6], radius: 0.03},
     may_be_touched_by: [wrist_3_link, forearm_1]}
keep_in: {box: {size: [1.4, 1.6, 1.0], center: [0.3, 0, 0.6]}}
)";

RobotModel arm_of_the_cell() { return *open_robot("ur5e", kPlaces); }

/// m, of a point and an obstacle; the bare shape without its margin.
double distance_to(const Obstacle& obstacle, const Vector3& point) {
  return distance(obstacle.shape, obstacle.at, Shape::sphere(1e-6), {point, Matrix3::Identity()}) + 1e-6;
}

TEST(CellFile, SaysWhatStandsThere) {
  const TemporaryFolder folder;
  const auto cell = open_cell(folder.write("mine.yaml", kExample).string(), kPlaces);
  ASSERT_TRUE(cell) << cell.error().message;
  EXPECT_EQ(cell->name, "mine");
  ASSERT_EQ(cell->objects.size(), 10u);  // with the faces of keep_in
  EXPECT_EQ(cell->objects[0].margin, 0.02);
  EXPECT_EQ(cell->objects[2].color, "#c28F5c");

  const RobotModel model = arm_of_the_cell();
  const auto made = obstacles_of(*cell, model);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_EQ(made->count, 10);
  const auto& list = made->list;
  EXPECT_NEAR(distance_to(list[0], {3.0, 4.0, 0.5}), 0.6 - 0.02, 1e-12);
  EXPECT_NEAR(distance_to(list[1], {0.5, 4.0, 7.0}), 0.4, 1e-12);
  EXPECT_NEAR(distance_to(list[2], {0.6, 0.3, 0.5}), 0.3 - 0.03, 1e-12);
  EXPECT_EQ(list[2].margin, 0.03);
  EXPECT_NEAR(distance_to(list[3], {0.9, -0.4, 0.3}), 0.47 - 0.02, 1e-12);
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const std::string link = model.link_names[body.link];
    EXPECT_EQ(list[3].ignores[i], link == "wrist_3_link" || body.name == "forearm_1") << body.name;
    EXPECT_FALSE(list[0].ignores[i]);
    EXPECT_EQ(list[4].ignores[i], body.link != model.dof()) << "the tool alone is kept in";
  }
  for (int face = 4; face < 10; ++face) {
    EXPECT_GT(distance_to(list[face], {0.3, 0.0, 0.6}), 0.4) << cell->objects[face].name;
  }
  const auto nearest = [&](const Vector3& point) {
    int least = 4;
    for (int face = 4; face < 10; ++face) {
      if (distance_to(list[face], point) < distance_to(list[least], point)) least = face;
    }
    return std::pair(cell->objects[least].name, distance_to(list[least], point));
  };
  EXPECT_EQ(nearest({0.9, 0.0, 0.6}).first, "keep_in +x");
  EXPECT_NEAR(nearest({0.9, 0.0, 0.6}).second, 0.1 - 0.02, 1e-12);
  EXPECT_EQ(nearest({0.3, -0.7, 0.6}).first, "keep_in -y");
  EXPECT_EQ(nearest({0.3, 0.0, 0.15}).first, "keep_in -z");
}

/// In the frame of the URDF's root a cell goes with the arm.
TEST(CellFile, MayStandInTheFrameOfTheRoot) {
  RobotModel model = arm_of_the_cell();
  model.mount = Eigen::Translation3d(0, 0, 1) * Eigen::AngleAxisd(M_PI, Vector3::UnitX());
  const TemporaryFolder folder;
  for (const auto& [frame, place] :
       {std::pair("base", Vector3(0.1, 0.2, 0.3)), std::pair("root", Vector3(0.1, -0.2, 0.7))}) {
    const auto cell = load_cell(folder.write(
        "cell.yaml",
        fmt::format("frame: {}\nobjects: [{{name: a, sphere: {{center: [0.1, 0.2, 0.3], radius: 0.1}}}}]\n", frame)));
    ASSERT_TRUE(cell) << cell.error().message;
    EXPECT_TRUE(obstacles_of(*cell, model)->list[0].at.p.isApprox(place, 1e-12)) << frame;
    EXPECT_TRUE(in_base(*cell, model).objects[0].origin.translation().isApprox(place, 1e-12)) << frame;
  }
}

/// None of them touches the arm in its first posture.
TEST(CellFile, OursAreReadAndLeaveTheArmFree) {
  for (const std::string& name : names_in(kPlaces, "cells")) {
    const auto opened = open_robot(name == "ceiling" ? "ur5e_ceiling" : "ur5e", kPlaces);
    ASSERT_TRUE(opened) << opened.error().message;
    const RobotModel& model = *opened;
    Kinematics arm(model);
    arm.set_position(model.home);
    const auto cell = open_cell(name, kPlaces);
    ASSERT_TRUE(cell) << cell.error().message;
    const auto obstacles = obstacles_of(*cell, model);
    ASSERT_TRUE(obstacles) << obstacles.error().message;
    for (const Obstacle& obstacle : obstacles->all()) {
      for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) {
        EXPECT_TRUE(model.bodies[i].link == 0 || gap(arm, i, obstacle.shape, obstacle.at) > 0.0) << name;
      }
    }
  }
  EXPECT_TRUE(open_cell("none", kPlaces)->objects.empty());
  const auto missing = open_cell("tabel", kPlaces);
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find(
                "cell 'tabel' is neither a file nor one of the names in cells/: ceiling, pedestal, table"),
            std::string::npos)
      << missing.error().message;
}

class CellFileRefuses : public testing::TestWithParam<Refusal> {};

TEST_P(CellFileRefuses, WithTheReason) {
  const TemporaryFolder folder;
  const auto cell = open_cell(folder.write("cell.yaml", GetParam().text).string(), kPlaces);
  const auto made = cell ? obstacles_of(*cell, arm_of_the_cell()) : Result<Obstacles>(cell.error());
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().message.find(GetParam().message), std::string::npos) << made.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    All, CellFileRefuses,
    testing::Values(
        Refusal{"key", "object: []\n", "cell.yaml:1: unknown key 'object'; did you mean 'objects'?"},
        Refusal{"no_name", "objects: [{sphere: {radius: 1}}]\n", "key 'objects[0].name' is missing"},
        Refusal{"empty_name", "objects: [{name: '', sphere: {radius: 1}}]\n", "objects[0].name is empty"},
        Refusal{"no_shape", "objects: [{name: a}]\n",
                "objects[0].shape must be one of sphere, capsule, box, cylinder and half_space"},
        Refusal{"size", "objects: [{name: a, box: {size: [1, 0, 1]}}]\n", "objects[0].box.size[1] is 0"},
        Refusal{"huge", "objects: [{name: a, sphere: {radius: 1e300}}]\n", "object 'a': the radius is 1e+300 m"},
        Refusal{"far", "objects: [{name: a, sphere: {radius: 1, center: [1e9, 0, 0]}}]\n",
                "object 'a': must be within 1000 m"},
        Refusal{"nan", "objects: [{name: a, sphere: {radius: .nan}}]\n", "radius is '.nan'"},
        Refusal{"normal", "objects: [{name: a, half_space: {point: [0, 0, 0], normal: [0, 0, 0]}}]\n",
                "objects[0].half_space.normal must not be 0"},
        Refusal{"no_point", "objects: [{name: a, half_space: {}}]\n", "key 'objects[0].half_space.point' is missing"},
        Refusal{"margin", "margin: -1\n", "margin is -1"},
        Refusal{"margin_of_one", "objects: [{name: a, sphere: {radius: 1}, margin: 2}]\n", "objects[0].margin is 2"},
        Refusal{"color", "objects: [{name: a, sphere: {radius: 1}, color: red}]\n", "objects[0].color must be"},
        Refusal{"twice", "objects: [{name: a, sphere: {radius: 1}}, {name: a, sphere: {radius: 1}}]\n",
                "object 'a': there are two of this name"},
        Refusal{"touch", "objects: [{name: a, sphere: {radius: 1}, may_be_touched_by: [hand]}]\n",
                "object 'a': robot 'ur5e' has no body or link 'hand'"},
        Refusal{"touch_text", "objects: [{name: a, sphere: {radius: 1}, may_be_touched_by: hand}]\n",
                "may_be_touched_by is"},
        Refusal{"touch_list", "objects: [{name: a, sphere: {radius: 1}, may_be_touched_by: [[hand]]}]\n",
                "may_be_touched_by[0] is"},
        Refusal{"keep_in", "keep_in: {sphere: {radius: 1}}\n", "keep_in.box must be there"},
        Refusal{"objects_no_list", "objects: {}\n", "objects"}),
    refusal_name);

TEST(CellFile, TenThousandObjectsAreRefused) {
  const TemporaryFolder folder;
  std::string text = "objects:\n";
  for (int i = 0; i < 10000; ++i) text += "  - {name: o" + std::to_string(i) + ", sphere: {radius: 1}}\n";
  const auto cell = open_cell(folder.write("many.yaml", text).string(), kPlaces);
  ASSERT_TRUE(cell) << cell.error().message;
  const auto made = obstacles_of(*cell, arm_of_the_cell());
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().message, "cell 'many': 10000 objects; there may be at most 64");
}

}  // namespace
}  // namespace steadyhand
