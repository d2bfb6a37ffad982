#include "session/session_library.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <future>
#include <nlohmann/json.hpp>

#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

TEST(SessionLibrary, OfAFolderThatIsNotThereIsEmpty) {
  TemporaryFolder folder;
  const SessionLibrary library(folder.path() / "none");
  const Result<FreshPage> page = library.read("/sessions");
  ASSERT_TRUE(page);
  EXPECT_EQ(Json::parse(page->body), Json({{"sessions", Json::array()}}));
  EXPECT_FALSE(page->document);
}

TEST(SessionLibrary, LeavesItsFolderForNobody) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "inside");
  std::ofstream(folder.path() / "secret.mcap") << "secret";
  const SessionLibrary library(folder.path() / "inside");
  for (const char* path : {"/sessions/../secret/motion", "/sessions/..%2Fsecret/motion", "/sessions/%2e%2e/motion",
                           "/sessions//motion", "/sessions/a/b/motion", "/sessions/a", "/sessions/a/", "/sessions/",
                           "/sessions/.hidden/motion", "/", "", "/sessions/a\n/motion"}) {
    const Result<FreshPage> page = library.read(path);
    ASSERT_FALSE(page) << path;
    EXPECT_NE(page.error().message.find("there is /sessions"), std::string::npos) << path;
  }
}

TEST(SessionLibrary, SaysWhatIsWrongWithAFile) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "broken.mcap") << "no MCAP at all";
  const SessionLibrary library(folder.path());
  for (const char* path : {"/sessions/broken/motion", "/sessions/broken/report.html", "/sessions/missing/motion"}) {
    const Result<FreshPage> page = library.read(path);
    ASSERT_FALSE(page) << path;
    EXPECT_NE(page.error().message.find(".mcap"), std::string::npos) << page.error().message;
  }
}

TEST(SessionLibrary, AnswersEveryRequestFromItsOwnThread) {
  TemporaryFolder folder;
  std::vector<std::promise<std::thread::id>> answered(20);
  {
    SessionLibrary library(folder.path());
    for (auto& one : answered) {
      library.fetch("/sessions", [&one](const Result<FreshPage>& page) {
        EXPECT_TRUE(page);
        one.set_value(std::this_thread::get_id());
      });
    }
  }
  for (auto& one : answered) EXPECT_NE(one.get_future().get(), std::this_thread::get_id());
}

}  // namespace
}  // namespace steadyhand
