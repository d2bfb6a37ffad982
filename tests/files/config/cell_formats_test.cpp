// Cells as MoveIt, cuRobo and URDFs have them.
#include "steadyhand/files/config/cell_formats.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "steadyhand/files/config/cell_file.hpp"
#include "steadyhand/files/config/open.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

// A box of 0.2 x 0.4 x 0.6, turned by a quarter about z and 1 m along x, with what else there is.
const std::string kOldScene = R"((some scene)
* box
1
box
0.2 0.4 0.6
1 0 0
0 0 0.70710678 0.70710678
1 0.5 0 1
* two things
2
sphere
0.1
0 0 1
0 0 0 1
0 0 0 0
cone
0.1 0.3
0 0 2
0 0 0 1
0 0 0 0
.
)";
const std::string kScene = R"((some scene)
* box
1 0 0
0 0 0.70710678 0.70710678
1
box
0.2 0.4 0.6
0 0 0
0 0 0 1
1 0.5 0 1
0
* two things
0 0 1
0 0 0 1
2
sphere
0.1
0 0 0
0 0 0 1
0 0 0 0
cone
0.1 0.3
0 0 1
0 0 0 1
0 0 0 0
1
handle
0 0 0
0 0 0 1
.
)";
// Two solids of one object, and others called as the second and the third would be.
const std::string kTakenNames = R"(names
* rack
1
sphere
0.1
0 0 0
0 0 0 1
0 0 0 0
* rack 2
2
sphere
0.2
0 0 0
0 0 0 1
0 0 0 0
sphere
0.3
0 0 0
0 0 0 1
0 0 0 0
* rack
1
sphere
0.4
0 0 0
0 0 0 1
0 0 0 0
* rack 3
1
sphere
0.5
0 0 0
0 0 0 1
0 0 0 0
.
)";
const std::string kWorld = R"(
cuboid:
  box: {dims: [0.2, 0.4, 0.6], pose: [1, 0, 0, 0.70710678, 0, 0, 0.70710678], color: [1, 0.5, 0, 1]}
sphere:
  two things: {radius: 0.1, position: [0, 0, 1]}
cylinder:
  two things 2: {radius: 0.1, height: 0.3, pose: [0, 0, 2, 1, 0, 0, 0]}
capsule:
  post: {radius: 0.05, base: [0, 1, 0], tip: [0, 1, 0.5]}
)";
const std::string kUrdf = R"(<robot name="cell">
  <link name="world"/>
  <link name="box"><collision><geometry><box size="0.2 0.4 0.6"/></geometry></collision></link>
  <link name="two things">
    <collision><origin xyz="0 0 1"/><geometry><sphere radius="0.1"/></geometry></collision>
    <collision><origin xyz="0 0 2"/><geometry><cylinder radius="0.1" length="0.3"/></geometry></collision>
  </link>
  <joint name="a" type="fixed"><parent link="world"/><child link="box"/><origin xyz="1 0 0" rpy="0 0 1.57079633"/></joint>
  <joint name="b" type="fixed"><parent link="world"/><child link="two things"/></joint>
</robot>
)";

struct Format {
  const char *name, *file;
  const std::string* text;
};
class CellFormat : public testing::TestWithParam<Format> {};

TEST_P(CellFormat, HasTheSolidsWhereTheyAre) {
  const TemporaryFolder folder;
  const auto cell = open_cell(folder.write(GetParam().file, *GetParam().text).string());
  ASSERT_TRUE(cell) << cell.error().message;
  ASSERT_GE(cell->objects.size(), 3u);
  const auto find = [&](const std::string& name) {
    const auto at =
        std::find_if(cell->objects.begin(), cell->objects.end(), [&](const auto& o) { return o.name == name; });
    EXPECT_NE(at, cell->objects.end()) << name;
    return *at;
  };
  const CellObject box = find("box"), sphere = find("two things"), cylinder = find("two things 2");
  EXPECT_EQ(box.shape.kind, ShapeKind::kBox);
  EXPECT_TRUE(box.shape.core.isApprox(Vector3(0.1, 0.2, 0.3)));
  EXPECT_TRUE((box.origin * Vector3(0.1, 0.2, 0.3)).isApprox(Vector3(0.8, 0.1, 0.3), 1e-6)) << "turned to the left";
  EXPECT_EQ(sphere.shape.kind, ShapeKind::kSphere);
  EXPECT_EQ(sphere.shape.radius, 0.1);
  EXPECT_TRUE(sphere.origin.translation().isApprox(Vector3(0.0, 0.0, 1.0), 1e-9));
  EXPECT_EQ(cylinder.shape.kind, ShapeKind::kCylinder);
  EXPECT_TRUE(cylinder.shape.core.isApprox(Vector3(0.1, 0.1, 0.15)));
  EXPECT_TRUE(cylinder.origin.translation().isApprox(Vector3(0.0, 0.0, 2.0), 1e-9));
  if (GetParam().text != &kUrdf) {
    EXPECT_EQ(box.color, "#ff8000");
  }
  EXPECT_EQ(box.margin, CellObject().margin);
}

INSTANTIATE_TEST_SUITE_P(All, CellFormat,
                         testing::Values(Format{"old_scene", "cell.scene", &kOldScene},
                                         Format{"scene", "cell.scene", &kScene}, Format{"curobo", "cell.yaml", &kWorld},
                                         Format{"urdf", "cell.urdf", &kUrdf}),
                         [](const auto& each) { return each.param.name; });

TEST(CellFormat, ACapsuleGoesFromBaseToTip) {
  const TemporaryFolder folder;
  const auto cell = open_cell(folder.write("cell.yaml", kWorld).string());
  ASSERT_TRUE(cell) << cell.error().message;
  const CellObject& post = cell->objects.at(2);
  ASSERT_EQ(post.name, "post");
  EXPECT_TRUE((post.origin * Vector3(0.0, 0.0, post.shape.core.z())).isApprox(Vector3(0.0, 1.0, 0.5), 1e-9));
}

TEST(CellFormat, FurtherSolidsOfAnObjectTakeNoOtherObjectsName) {
  const TemporaryFolder folder;
  const auto cell = load_cell(folder.write("taken.scene", kTakenNames));
  ASSERT_TRUE(cell) << cell.error().message;
  std::vector<std::string> names;
  for (const CellObject& object : cell->objects) names.push_back(object.name);
  EXPECT_EQ(names, (std::vector<std::string>{"rack", "rack 2", "rack 2 2", "rack 4", "rack 3"}));
}

/// Whole lines are missing at the end: never a crash, and an error that states where.
TEST(CellFormat, ASceneThatIsCutShortIsRefused) {
  for (const std::string& text : {kOldScene, kScene}) {
    const TemporaryFolder folder;
    for (std::size_t end = text.rfind('.'); end > 0; end = text.rfind('\n', end - 1)) {
      const auto cell = load_moveit_scene(folder.write("cut.scene", text.substr(0, end)));
      ASSERT_FALSE(cell) << end;
      EXPECT_NE(cell.error().message.find("cut.scene"), std::string::npos) << cell.error().message;
      if (end == text.find('\n')) break;
    }
  }
}

/// The only link is a table whose <inertial> cannot be read.
TEST(CellFormat, AUrdfsTableIsThereWhateverItWeighs) {
  const TemporaryFolder folder;
  const auto cell = open_cell(folder
                                  .write("cell.urdf",
                                         "<robot name='a'><link name='table'><inertial><mass value='20 kg'/></inertial>"
                                         "<visual><geometry><cylinder radius='1'/></geometry></visual><collision>"
                                         "<geometry><sphere radius='0.5'/></geometry></collision></link></robot>")
                                  .string());
  ASSERT_TRUE(cell) << cell.error().message;
  ASSERT_EQ(cell->objects.size(), 1u);
  EXPECT_EQ(cell->objects[0].shape.radius, 0.5);
}

struct BadCell {
  const char *name, *file, *text, *message;
};
class CellFormatRefuses : public testing::TestWithParam<BadCell> {};

TEST_P(CellFormatRefuses, WithTheReason) {
  const TemporaryFolder folder;
  const auto cell = open_cell(folder.write(GetParam().file, GetParam().text).string());
  ASSERT_FALSE(cell);
  EXPECT_NE(cell.error().message.find(GetParam().message), std::string::npos) << cell.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    All, CellFormatRefuses,
    testing::Values(
        BadCell{"scene_empty", "a.scene", "", "a.scene: the file ends where the scene's name should be"},
        BadCell{"scene_mesh", "a.scene", "s\n* a\n1\nmesh\n", "a.scene:4: shape 'mesh' is not read; box, sphere"},
        BadCell{"scene_number", "a.scene", "s\n* a\n1\nbox\n1 x 1\n", "a.scene:5: the box's sizes: 'x'"},
        BadCell{"scene_numbers", "a.scene", "s\n* a\n1\nbox\n1 1\n",
                "a.scene:5: the box's sizes are 3 numbers; here are 2"},
        BadCell{"scene_nan", "a.scene", "s\n* a\n1\nsphere\nnan\n", "a.scene:5: the sphere's radius: 'nan'"},
        BadCell{"scene_count", "a.scene", "s\n* a\n1e9\n", "a.scene:3: the number of shapes is 1000000000; it must be"},
        BadCell{"scene_norm", "a.scene", "s\n* a\n1\nsphere\n1\n0 0 0\n0 0 0 2\n",
                "a.scene:7: the quaternion x, y, z, w is of norm 2"},
        BadCell{"scene_line", "a.scene", "s\n* a\n0\nbox\n", "a.scene:4: 'box' is not valid; expected '* NAME'"},
        BadCell{"world_mesh", "a.yaml", "mesh: {a: {file_path: b.obj}}\n", "a.yaml:1: mesh has 'a', which is not read"},
        BadCell{"world_pose", "a.yaml", "cuboid: {a: {dims: [1, 1, 1], pose: [0, 0, 0]}}\n", "pose"},
        BadCell{"world_norm", "a.yaml", "cuboid: {a: {dims: [1, 1, 1], pose: [0, 0, 0, 0, 0, 0, 0]}}\n",
                "of norm 0; it must be 1"},
        BadCell{"world_size", "a.yaml", "cuboid: {a: {dims: [1, 0, 1], pose: [0, 0, 0, 1, 0, 0, 0]}}\n",
                "dims[1] is 0"},
        BadCell{"world_key", "a.yaml", "sphere: {a: {radius: 1, position: [0, 0, 0], raduis: 2}}\n", "unknown key"},
        BadCell{"urdf_moves", "a.urdf",
                "<robot name='a'><link name='a'/><link name='b'/><joint name='j' type='floating'><parent "
                "link='a'/><child link='b'/>"
                "</joint></robot>",
                "joint 'j' is not fixed; a cell must be stationary"},
        BadCell{"urdf_size", "a.urdf",
                "<robot name='a'><link name='a'><collision><geometry><sphere radius='1'/></geometry></collision>"
                "<collision><geometry><box/></geometry></collision></link></robot>",
                "a.urdf:1: the <collision> of link 'a' cannot be read: Box shape has no size attribute; a <collision> "
                "needs "
                "a <geometry> with its sizes"},
        BadCell{"urdf_shapes", "a.urdf",
                "<robot name='a'><link name='a'><collision><geometry><sphere radius='1'/><box size='1 1 1'/></geometry>"
                "</collision></link></robot>",
                "a.urdf:1: the <collision> of link 'a' cannot be read: it has 2 shapes"},
        BadCell{"urdf_macros", "a.urdf", "<robot name='a'>\n<xacro:table/></robot>",
                "a.urdf:2: <xacro:table> is a xacro macro"},
        BadCell{"xacro_macros", "a.urdf.xacro", "<robot name='a'>\n<xacro:table/></robot>",
                "a.urdf.xacro:2: <xacro:table> is a xacro macro"},
        BadCell{"urdf_nan", "a.urdf",
                "<robot name='a'><link name='a'><collision><origin xyz='0 nan 0'/><geometry><sphere radius='1'/>"
                "</geometry></collision></link></robot>",
                "needs a <geometry> with its sizes, and finite numbers"},
        BadCell{"urdf_nothing", "a.urdf", "<robot name='a'><link name='a'/></robot>", "no link has a <collision>"}),
    [](const auto& each) { return each.param.name; });

}  // namespace
}  // namespace steadyhand
