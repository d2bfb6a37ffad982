#include "steadyhand/files/config/task_file.hpp"

#include <gtest/gtest.h>

#include "files/config/refusal.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

constexpr const char* kTaskExample = R"(instruction: Bring the block to the mark.
scene: bring.xml
place:
  - {thing: block, x: [0.3, 0.5], y: [-0.2, 0.2], yaw: [0, 1], z: 0.1}
success:
  - {near: [block, mark], within: 0.02, height: 0.01}
  - {still: block, speed: 0.01}
)";

std::string with(const std::string& from, const std::string& to) {
  std::string text = kTaskExample;
  return text.replace(text.find(from), from.size(), to);
}

TEST(TaskFile, SaysWhatIsToBeDone) {
  const TemporaryFolder folder;
  const auto task = load_task(folder.write("bring.yaml", kTaskExample));
  ASSERT_TRUE(task) << task.error().message;
  EXPECT_EQ(task->name, "bring");
  EXPECT_EQ(task->scene, (folder.path() / "bring.xml").string());
  EXPECT_EQ(task->things, (std::vector<std::string>{"block", "mark"}));
  ASSERT_EQ(task->success.size(), 2u);
  EXPECT_EQ(task->success[0].kind, Condition::Kind::kNear);
  EXPECT_EQ(task->success[0].other, 1);
  EXPECT_EQ(task->success[0].text, "block at mark");
  EXPECT_EQ(task->placings[0].yaw[1], 1.0);
  EXPECT_EQ(open_task("none")->name, "");
}

TEST(TaskFile, RefusesWhatItCannotMean) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text) {
    const auto task = load_task(folder.write("bad.yaml", text));
    return task ? std::string("taken") : task.error().message;
  };
  for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
           {"", "bad.yaml"},
           {with("[0.3, 0.5]", "[0.5, 0.3]"), "the first must not be larger"},
           {with("[0.3, 0.5]", "[0.5]"), "bad.yaml:4: place[0].x"},
           {with("[0.3, 0.5]", "[.nan, 0.5]"), "bad.yaml:4: place[0].x"},
           {with("[block, mark]", "[block]"), "names 1 things; it must be two"},
           {with("near", "nearby"), "bad.yaml:6: unknown key 'nearby' in 'success[0]'; did you mean 'near'?"},
           {with("speed: 0.01", "speed: 0"), "bad.yaml:7: success[1].speed"},
           {with("scene: bring.xml\n", ""), "scene"},
           {std::string(kTaskExample) + "time_limit: -1\n", "time_limit"},
           {std::string(kTaskExample) + "colour: red\n", "colour"}}) {
    EXPECT_NE(refusal(text).find(words), std::string::npos) << refusal(text);
  }
  std::string crowded(kTaskExample);
  for (int i = 0; i < 20; ++i) crowded += "  - {upright: t" + std::to_string(i) + ", within: 0.1}\n";
  EXPECT_NE(refusal(crowded).find("is thing number 17; a task names 16 at most"), std::string::npos);
}

TEST(TaskFile, ThoseThatComeWithTheProgramAreRead) {
  for (const std::string& name : names_in(Places::standard(), "tasks")) {
    const auto task = open_task(name);
    EXPECT_TRUE(task) << task.error().message;
  }
  ASSERT_FALSE(open_task("carri"));
  EXPECT_NE(open_task("carri").error().message.find("carry"), std::string::npos);
}

}  // namespace
}  // namespace steadyhand
