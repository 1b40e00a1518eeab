#include "runtime/run/run_folder.hpp"

#include <gtest/gtest.h>

#include "io/device.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

namespace fs = std::filesystem;
using tests::TemporaryFolder;

TEST(RunFolder, IsCreatedWithItsParents) {
  const TemporaryFolder folder;
  const RunFolder run(folder.path() / "a/b");
  EXPECT_TRUE(fs::is_directory(folder.path() / "a/b"));
}

TEST(RunFolder, ClearRemovesOnlyTheResultsOfAnEarlierRun) {
  const TemporaryFolder folder;
  const char* const results[] = {
      "report.json",           "report.html",         "junit.xml",           "trace.json",
      "pictures/top-view.svg", "pictures/scan-1.svg", "pictures/scan-2.svg", "pointclouds/lidar-000001.pcd",
      "recording.mcap"};
  for (const char* file : results)
    folder.write(file, "passed");
  folder.write("notes.txt", "of the user");
  folder.write("pointclouds/notes.txt", "of the user");
  folder.write("a.out", "of the user");
  const RunFolder run(folder.path());
  EXPECT_EQ(folder.read("junit.xml"), "passed");
  run.clear();
  for (const char* file : results)
    EXPECT_FALSE(fs::exists(folder.path() / file)) << file;
  EXPECT_EQ(folder.read("notes.txt"), "of the user");
  EXPECT_EQ(folder.read("a.out"), "of the user");
  EXPECT_EQ(folder.read("pointclouds/notes.txt"), "of the user");
}

TEST(RunFolder, ClearRemovesTheLogOfAnEarlierRunOnly) {
  const TemporaryFolder folder;
  for (const char* file : {"lock", "segment.0000000001", "segment.0000000002.new", "checkpoint.0000000001",
                           "geometry.0000000003"})
    folder.write(std::string("database/") + file, "of a run");
  folder.write("world.json", "{}");
  {
    const RunFolder run(folder.path());
    run.clear();
    EXPECT_FALSE(fs::exists(folder.path() / "database"));
    EXPECT_FALSE(fs::exists(folder.path() / "world.json"));
  }
  folder.write("database/lock", "of a run");
  folder.write("database/thesis.txt", "of the user");
  folder.write("junit.xml", "passed");
  const RunFolder run(folder.path());
  try {
    run.clear();
    FAIL() << "the log would be among files of the user";
  } catch (const io::DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("database"), std::string::npos) << error.what();
  }
  EXPECT_EQ(folder.read("database/thesis.txt"), "of the user");
  EXPECT_FALSE(fs::exists(folder.path() / "junit.xml")) << "it would be taken for the result of this run";
}

TEST(RunFolder, LinksAreRefusedAndNothingBehindThemChanges) {
  for (const char* const name :
       {"database", "images", "pictures", "pointclouds", "report.html", "report.json", "junit.xml.part",
        "signals.csv", "x.out", "latest", "database/segment.0000000001", "images/view-x.png",
        "pictures/top-view.svg", "pointclouds/lidar-000001.pcd"}) {
    for (const char* const target : {"folder", "file", "nothing"}) {
      const TemporaryFolder elsewhere;
      elsewhere.write("folder/segment.0000000001", "of the user");
      elsewhere.write("folder/a.svg", "of the user");
      elsewhere.write("file", "of the user");
      const TemporaryFolder folder;
      folder.write("report.html.txt", "of the user");
      if (std::string(name) != "report.json") folder.write("report.json", "passed");
      fs::create_directories((folder.path() / name).parent_path());
      fs::create_symlink(elsewhere.path() / target, folder.path() / name);
      try {
        const RunFolder run(folder.path());
        FAIL() << name << " to " << target;
      } catch (const io::DeviceError& error) {
        EXPECT_NE(std::string(error.what()).find(std::string(name) + " is a link to"), std::string::npos)
            << error.what();
      }
      EXPECT_TRUE(fs::is_symlink(folder.path() / name));
      EXPECT_EQ(elsewhere.read("folder/segment.0000000001"), "of the user");
      EXPECT_EQ(elsewhere.read("folder/a.svg"), "of the user");
      EXPECT_EQ(elsewhere.read("file"), "of the user");
      EXPECT_FALSE(fs::exists(elsewhere.path() / "nothing"));
      if (std::string(name) != "report.json") {
        EXPECT_FALSE(fs::exists(folder.path() / "report.json")) << "the verdict of an earlier run";
      }
      fs::remove(folder.path() / name);
      const RunFolder unlocked(folder.path());
    }
  }
}

TEST(RunFolder, TheFolderItselfMayBeALink) {
  const TemporaryFolder folder;
  fs::create_directories(folder.path() / "run-5");
  fs::create_symlink("run-5", folder.path() / "latest");
  const RunFolder run(folder.path() / "latest");
  run.clear();
}

TEST(RunFolder, IsUsedByOneRunAtATime) {
  const TemporaryFolder folder;
  {
    const RunFolder run(folder.path());
    folder.write("report.json", "of the first run");
    try {
      const RunFolder second(folder.path());
      FAIL() << "a second run in the folder";
    } catch (const io::DeviceError& error) {
      EXPECT_NE(std::string(error.what()).find("in use by another run"), std::string::npos) << error.what();
    }
    EXPECT_EQ(folder.read("report.json"), "of the first run");
  }
  const RunFolder after(folder.path());
}

TEST(RunFolder, PathOfAFileIsRefused) {
  const TemporaryFolder folder;
  folder.write("file", "x");
  EXPECT_THROW(const RunFolder run(folder.path() / "file"), io::DeviceError);
  EXPECT_THROW(const RunFolder run(folder.path() / "file/below"), io::DeviceError);
}

}  // namespace
}  // namespace hil::run
