#include "steadyhand/files/archive/recording_folder.hpp"

#include <dirent.h>
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <fstream>
#include <set>

#include "support/temporary_folder.hpp"

/// How many entries of folders can be read until the disk fails; -1: all. On this thread.
thread_local int entries_until_failure = -1;

/// In place of the C library's, which std::filesystem calls.
extern "C" dirent* readdir(DIR* folder) {
  static const auto usual = reinterpret_cast<dirent* (*)(DIR*)>(dlsym(RTLD_NEXT, "readdir"));
  if (entries_until_failure == 0) {
    errno = EIO;
    return nullptr;
  }
  if (entries_until_failure > 0) --entries_until_failure;
  return usual(folder);
}

namespace steadyhand {
namespace {

namespace fs = std::filesystem;

/// A file of so many bytes, last written an hour ago.
fs::path put(const fs::path& folder, const std::string& name, std::size_t bytes) {
  const fs::path path = folder / name;
  std::ofstream(path, std::ios::binary) << std::string(bytes, 'x');
  fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(1));
  return path;
}

std::set<std::string> names(const fs::path& folder) {
  std::set<std::string> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    found.insert(entry.path().filename().string());
  return found;
}

TEST(RecordingFolder, KnowsItsOwnRecordings) {
  for (const char* own : {"2026-11-21_20-14-57.mcap", "2026-11-21_20-14-57_2.mcap", "2026-11-21_20-14-57_13.mcap"}) {
    EXPECT_TRUE(is_recording_name(own)) << own;
  }
  for (const char* other :
       {"2026-11-21_20-14-57-fault-1.mcap", "2026-11-21_20-14-57.html", "2026-11-21.mcap", "mine.mcap",
        "2026-11-21_20-14-57_.mcap", "2026-11-21_20-14-57_x.mcap", "2026-11-21_20-14-57", ".mcap", ""}) {
    EXPECT_FALSE(is_recording_name(other)) << other;
  }
}

TEST(RecordingFolder, DeletesTheOldestOfItsOwnUntilTheRestFits) {
  TemporaryFolder folder;
  put(folder.path(), "2026-01-03_00-00-00.mcap", 400);
  put(folder.path(), "2026-01-01_00-00-00.mcap", 400);
  put(folder.path(), "2026-01-02_00-00-00.mcap", 400);
  put(folder.path(), "2026-01-02_00-00-00_2.mcap", 400);
  const std::set<std::string> others = {"2026-01-01_00-00-00-fault-1.mcap", "2026-01-01_00-00-00.html", "mine.mcap"};
  for (const std::string& name : others) put(folder.path(), name, 5000);

  EXPECT_EQ(prune_recordings(folder.path(), 1600, "").files, 0);
  const Pruned pruned = prune_recordings(folder.path(), 1000, "");
  EXPECT_EQ(pruned.files, 2);
  EXPECT_EQ(pruned.bytes, 800u);
  EXPECT_EQ(pruned.newest, "2026-01-02_00-00-00.mcap");
  std::set<std::string> left = others;
  left.insert({"2026-01-02_00-00-00_2.mcap", "2026-01-03_00-00-00.mcap"});
  EXPECT_EQ(names(folder.path()), left);
}

TEST(RecordingFolder, LeavesAloneWhatIsBeingWritten) {
  TemporaryFolder folder;
  const fs::path mine = put(folder.path(), "2026-01-01_00-00-00.mcap", 400);
  const fs::path another = put(folder.path(), "2026-01-02_00-00-00.mcap", 400);
  fs::last_write_time(another, fs::file_time_type::clock::now());
  put(folder.path(), "2026-01-03_00-00-00.mcap", 400);
  EXPECT_EQ(prune_recordings(folder.path(), 0, mine).files, 1);
  EXPECT_TRUE(fs::exists(mine) && fs::exists(another));
  EXPECT_EQ(prune_recordings(folder.path() / "nowhere", 0, mine).files, 0);
}

/// The writer's thread looks at the folder, and what it throws would stop the arm.
TEST(RecordingFolder, ThatCannotBeReadOnIsNoReasonToThrow) {
  TemporaryFolder folder;
  for (const char* name : {"2026-01-01_00-00-00.mcap", "2026-01-02_00-00-00.mcap", "2026-01-03_00-00-00.mcap"})
    put(folder.path(), name, 400);
  entries_until_failure = 4;  // with . and ..
  EXPECT_NO_THROW(EXPECT_LE(prune_recordings(folder.path(), 0, "").files, 3));
  EXPECT_EQ(entries_until_failure, 0);
  entries_until_failure = -1;
}

}  // namespace
}  // namespace steadyhand
