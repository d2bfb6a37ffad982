#include "steadyhand/geometry/robot/urdf_file.hpp"

#include <gtest/gtest.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include "geometry/robot/urdf_text.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"
#include "steadyhand/geometry/robot/urdf_dynamics.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

const std::string kBall = "<geometry><sphere radius='0.1'/></geometry>";
const std::string kInertia = "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>";

/// An arm of one joint whose link l1 has `before`, and then a ball that is seen and a ball that is touched.
std::string arm_with(const std::string& before) {
  const std::string link =
      urdf_link("l1", before + "<visual>" + kBall + "</visual><collision>" + kBall + "</collision>");
  return urdf_robot(urdf_link("l0") + link + urdf_joint("j1", "revolute", "l0", "l1"));
}

struct Unreadable {
  const char *name, *element;  ///< none: nothing is left out
  std::string text;
};

void PrintTo(const Unreadable& each, std::ostream* stream) { *stream << each.name; }

class ReadLink : public testing::TestWithParam<Unreadable> {};

TEST_P(ReadLink, KeepsItsSolidsWhateverStandsBeforeThem) {
  const TemporaryFolder folder;
  folder.write("a.stl", "");
  const auto file = folder.write("arm.urdf", arm_with(GetParam().text));
  std::vector<UnreadElement> unread;
  const auto model = read_urdf(file, Xacro::kIfNamed, &unread);
  ASSERT_TRUE(model) << model.error().message;
  const auto link = (*model)->getLink("l1");
  EXPECT_EQ(link->collision_array.size(), 1u);
  EXPECT_EQ(link->visual_array.size(), GetParam().element == nullptr ? 2u : 1u);
  ASSERT_EQ(unread.size(), GetParam().element == nullptr ? 0u : 1u);
  if (unread.empty()) return;
  EXPECT_EQ(unread[0].link, "l1");
  EXPECT_EQ(unread[0].element, GetParam().element);
  EXPECT_EQ(unread[0].where, file.string() + ":4");
  EXPECT_FALSE(unread[0].reason.empty());

  const auto chain = read_urdf_chain(file, {});
  ASSERT_TRUE(chain) << chain.error().message;
  ASSERT_EQ(chain->notes.size(), 1u);
  EXPECT_NE(chain->notes[0].find("<" + unread[0].element + "> of link 'l1'"), std::string::npos) << chain->notes[0];
  if (unread[0].element == "inertial") {
    const auto dynamics = read_chain_dynamics(file, *chain);
    ASSERT_FALSE(dynamics);
    EXPECT_NE(dynamics.error().message.find("arm.urdf:4: the <inertial> of link 'l1'"), std::string::npos)
        << dynamics.error().message;
  }
}

std::string inertial(const std::string& text) { return "<inertial>" + text + "</inertial>"; }
std::string visual(const std::string& text) { return "<visual>" + text + "</visual>"; }

INSTANTIATE_TEST_SUITE_P(
    With, ReadLink,
    testing::Values(
        Unreadable{"no_mass", "inertial", inertial(kInertia)},
        Unreadable{"no_inertia", "inertial", inertial("<mass value='1'/>")},
        Unreadable{"no_ixy", "inertial", inertial("<mass value='1'/><inertia ixx='1' iyy='1' izz='1'/>")},
        Unreadable{"comma", "inertial", inertial("<mass value='1,5'/>" + kInertia)},
        Unreadable{"unit", "inertial", inertial("<mass value='1.2 kg'/>" + kInertia)},
        Unreadable{"nan", "inertial", inertial("<mass value='nan'/>" + kInertia)},
        Unreadable{"density", "inertial", inertial("<density value='1'/>")},
        Unreadable{"short_xyz", "visual", visual("<origin xyz='0 0'/>" + kBall)},
        Unreadable{"scale", "visual", visual("<geometry><mesh filename='a.stl' scale='1'/></geometry>")},
        Unreadable{"no_length", "visual", visual("<geometry><cylinder radius='1'/></geometry>")},
        Unreadable{"two_shapes", "visual", visual("<geometry><box size='1 1 1'/><sphere radius='1'/></geometry>")},
        Unreadable{"no_geometry", "visual", visual("")},
        Unreadable{"material_without_name", nullptr, visual(kBall + "<material><color rgba='1 0 0 1'/></material>")},
        Unreadable{"material_of_another", nullptr,
                   visual(kBall + "<material name='red'><color rgba='1 0 0 1'/></material>")}),
    [](const auto& each) { return each.param.name; });

Result<urdf::ModelInterfaceSharedPtr> read_text(const std::string& text, const char* name = "arm.urdf") {
  const TemporaryFolder folder;
  return read_urdf(folder.write(name, text));
}

TEST(ReadUrdf, ReadsALicenceBeforeTheDeclaration) {
  const auto model = read_text("<!-- licence -->\n" + arm_with(""));
  EXPECT_TRUE(model) << model.error().message;
}

/// A macro in a comment is text; a macro element is refused.
TEST(ReadUrdf, ExpandsNoMacrosOfAFileThatIsNotNamedXacro) {
  const auto commented = read_text(arm_with("<!-- <xacro:inertia mass='1'/> -->"));
  EXPECT_TRUE(commented) << commented.error().message;
  const auto macro = read_text(arm_with("<xacro:inertia mass='1'/>"));
  ASSERT_FALSE(macro);
  EXPECT_NE(macro.error().message.find("arm.urdf:4: <xacro:inertia> is a xacro macro. Macros can run any code"),
            std::string::npos)
      << macro.error().message;
}

/// xacro expands <xacro:NAME> only: a file with another prefix would lack the contents of its macros.
TEST(ReadUrdf, RefusesMacrosOfAnyPrefix) {
  const auto with = [](const std::string& space) {
    return read_text("<robot name='a' xmlns:x='" + space + "'><link name='base'/>\n<x:arm parent='base'/></robot>");
  };
  const auto macro = with("http://www.ros.org/wiki/xacro");
  ASSERT_FALSE(macro);
  EXPECT_NE(macro.error().message.find("arm.urdf:2: <x:arm> is a xacro macro (which xacro ignores: it expands only"),
            std::string::npos)
      << macro.error().message;
  EXPECT_TRUE(with("http://example.org/notes"));
}

TEST(ReadUrdf, NamesWhatIsNotTheFileItself) {
  const auto pointer = read_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n");
  ASSERT_FALSE(pointer);
  EXPECT_NE(pointer.error().message.find("arm.urdf is a Git LFS pointer"), std::string::npos);
  std::string little = "\xff\xfe", big = "\xfe\xff";
  for (const char c : arm_with("")) {
    little += {c, '\0'};
    big += {'\0', c};
  }
  for (const std::string& text : {little, big, little.substr(2)}) {
    const auto wide = read_text(text);
    ASSERT_FALSE(wide);
    EXPECT_NE(wide.error().message.find("arm.urdf is UTF-16; a URDF must be UTF-8"), std::string::npos)
        << wide.error().message;
  }
}

TEST(FindMesh, DecodesAUri) {
  const TemporaryFolder folder;
  const auto file = folder.write("my package/a b.stl", ""), literal = folder.write("my package/c%20d.stl", "");
  const std::filesystem::path inside = folder.path() / "my package";
  EXPECT_EQ(find_mesh(inside, "file://" + folder.path().string() + "/my%20package/a%20b.stl"), file);
  EXPECT_EQ(find_mesh(inside, "package://my%20package/a%20b.stl"), file);
  EXPECT_EQ(find_mesh(inside, "c%20d.stl"), literal);
  EXPECT_EQ(find_mesh(inside, "a%2.stl"), std::nullopt);
}

}  // namespace
}  // namespace steadyhand
