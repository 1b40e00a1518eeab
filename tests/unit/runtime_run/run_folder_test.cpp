#include "runtime/run/run_folder.hpp"

#include <gtest/gtest.h>

#include "io/device.hpp"
#include "run_test.hpp"

namespace hil::run {
namespace {

namespace fs = std::filesystem;
using testing::Folder;

TEST(RunFolder, IsMadeWithItsParents) {
  const Folder folder;
  const RunFolder mine(folder.path() / "a/b");
  EXPECT_TRUE(fs::is_directory(folder.path() / "a/b"));
}

TEST(RunFolder, ClearsTheResultsOfAnEarlierRunAndNothingElse) {
  const Folder folder;
  fs::create_directories(folder.path() / "pictures");
  const char* const results[] = {"report.json",        "report.html",           "junit.xml",
                                 "trace.json",         "pictures/top-view.svg", "pictures/scan-1.svg",
                                 "pictures/scan-2.svg"};
  for (const char* file : results)
    folder.write(file, "passed");
  folder.write("notes.txt", "mine");
  folder.write("a.out", "mine");
  const RunFolder mine(folder.path());
  EXPECT_EQ(folder.read("junit.xml"), "passed");
  mine.clear();
  for (const char* file : results)
    EXPECT_FALSE(fs::exists(folder.path() / file)) << file;
  EXPECT_EQ(folder.read("notes.txt"), "mine");
  EXPECT_EQ(folder.read("a.out"), "mine");
}

TEST(RunFolder, ClearsTheLogOfAnEarlierRunAndNoOtherFiles) {
  const Folder folder;
  fs::create_directories(folder.path() / "database");
  for (const char* file : {"lock", "segment.0000000001", "segment.0000000002.new", "checkpoint.0000000001",
                           "geometry.0000000003"})
    folder.write(std::string("database/") + file, "of a run");
  folder.write("world.json", "{}");
  {
    const RunFolder mine(folder.path());
    mine.clear();
    EXPECT_FALSE(fs::exists(folder.path() / "database"));
    EXPECT_FALSE(fs::exists(folder.path() / "world.json"));
  }
  fs::create_directories(folder.path() / "database");
  folder.write("database/lock", "of a run");
  folder.write("database/thesis.txt", "mine");
  folder.write("junit.xml", "passed");
  const RunFolder mine(folder.path());
  try {
    mine.clear();
    FAIL() << "a log would lie among somebody's files";
  } catch (const io::DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("database"), std::string::npos) << error.what();
  }
  EXPECT_EQ(folder.read("database/thesis.txt"), "mine");
  EXPECT_FALSE(fs::exists(folder.path() / "junit.xml")) << "it would say that this run passed";
}

TEST(RunFolder, BelongsToOneRunAtATime) {
  const Folder folder;
  {
    const RunFolder mine(folder.path());
    folder.write("report.json", "of the run that lives");
    try {
      const RunFolder second(folder.path());
      FAIL() << "two runs in one folder";
    } catch (const io::DeviceError& error) {
      EXPECT_NE(std::string(error.what()).find("in use by another run"), std::string::npos) << error.what();
    }
    EXPECT_EQ(folder.read("report.json"), "of the run that lives");
  }
  const RunFolder after(folder.path());
}

TEST(RunFolder, WhatIsNoFolderIsRefused) {
  const Folder folder;
  folder.write("file", "x");
  EXPECT_THROW(const RunFolder mine(folder.path() / "file"), io::DeviceError);
  EXPECT_THROW(const RunFolder mine(folder.path() / "file/below"), io::DeviceError);
}

}  // namespace
}  // namespace hil::run
