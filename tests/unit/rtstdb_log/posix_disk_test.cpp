// The Disk of a POSIX file system.

#include "rtstdb/log/posix_disk.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>

#include "rtstdb/log/directory.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb::log::test {
namespace {

class PosixDiskTest : public testing::Test {
 protected:
  static std::vector<std::byte> bytes(std::size_t count, int value) {
    return std::vector<std::byte>(count, static_cast<std::byte>(value));
  }

  hil::tests::TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "log";  ///< open_directory creates it
};

TEST_F(PosixDiskTest, WritesReadsAndRenames) {
  auto opened = open_directory(path_);
  ASSERT_TRUE(opened);
  Disk& disk = *opened.value();
  {
    auto file = disk.create("a");
    ASSERT_TRUE(file);
    EXPECT_FALSE(file.value()->preallocate(4096));
    EXPECT_FALSE(file.value()->write(100, bytes(50, 7)));
    EXPECT_FALSE(file.value()->sync());
    EXPECT_EQ(file.value()->size().value(), 4096u);
  }
  EXPECT_FALSE(disk.rename("a", "b"));
  EXPECT_FALSE(disk.sync_directory());
  auto file = disk.open("b");
  ASSERT_TRUE(file);
  std::vector<std::byte> read(100);
  EXPECT_EQ(file.value()->read(120, read).value(), 100u);
  EXPECT_EQ(read[29], std::byte{7});
  EXPECT_EQ(read[30], std::byte{0});
  EXPECT_EQ(file.value()->read(4090, read).value(), 6u);
  EXPECT_EQ(disk.list().value(), std::vector<std::string>{"b"});
  EXPECT_FALSE(disk.remove("b"));
  EXPECT_TRUE(disk.list().value().empty());
}

/// In a program that does not handle SIGXFSZ, both calls fail and the program survives. For files of the
/// program itself the signal still ends it.
TEST_F(PosixDiskTest, FileBeyondTheSizeLimitIsRefused) {
  const auto outcome = [this] {
    std::signal(SIGXFSZ, SIG_DFL);
    const rlimit limit{.rlim_cur = 8192, .rlim_max = RLIM_INFINITY};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto file = open_directory(path_).value()->create("a");
    const DiskFault allocated = file.value()->preallocate(16384);
    const DiskFault written = file.value()->write(16384, bytes(512, 7));
    const bool refused = allocated && allocated->number == EFBIG && written && written->number == EFBIG;
    const bool smaller_is_written = !file.value()->write(0, bytes(4096, 7));
    sigset_t pending;
    sigpending(&pending);
    std::exit(refused && smaller_is_written && sigismember(&pending, SIGXFSZ) == 0 ? 0 : 1);
  };
  EXPECT_EXIT(outcome(), testing::ExitedWithCode(0), "");
  const auto of_the_program = [this] {
    std::signal(SIGXFSZ, SIG_DFL);
    const rlimit limit{.rlim_cur = 8192, .rlim_max = RLIM_INFINITY};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto file = open_directory(path_).value()->create("b");
    static_cast<void>(file.value()->preallocate(16384));
    static_cast<void>(::truncate((path_ / "b").c_str(), 16384));
  };
  EXPECT_EXIT(of_the_program(), testing::KilledBySignal(SIGXFSZ), "");
}

TEST_F(PosixDiskTest, FaultsNameOperationAndFile) {
  auto opened = open_directory(path_);
  ASSERT_TRUE(opened);
  Disk& disk = *opened.value();
  ASSERT_TRUE(disk.create("a"));
  const auto again = disk.create("a");
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().number, EEXIST);
  EXPECT_EQ(again.error().describe(), "create of a: File exists");
  EXPECT_EQ(disk.open("none").error().number, ENOENT);
  EXPECT_EQ(disk.remove("none")->number, ENOENT);
  EXPECT_EQ(disk.rename("none", "b")->number, ENOENT);
  auto reading = disk.open("a");
  ASSERT_TRUE(reading);
  EXPECT_EQ(reading.value()->write(0, bytes(1, 1))->number, EBADF);
  EXPECT_FALSE(open_existing_directory(path_ / "none"));
}

TEST_F(PosixDiskTest, SyncOfADeletedFileFails) {
  auto opened = open_directory(path_);
  ASSERT_TRUE(opened);
  auto file = opened.value()->create("a");
  ASSERT_TRUE(file);
  EXPECT_FALSE(file.value()->write(0, bytes(50, 7)));
  EXPECT_FALSE(file.value()->sync());
  ASSERT_TRUE(std::filesystem::remove(path_ / "a"));
  EXPECT_FALSE(file.value()->write(50, bytes(50, 7))) << "only the sync detects it";
  const DiskFault removed = file.value()->sync();
  ASSERT_TRUE(removed);
  EXPECT_EQ(removed->describe(), "sync of a: No such file or directory");
}

TEST_F(PosixDiskTest, LockIsExclusive) {
  auto first = open_directory(path_);
  auto second = open_directory(path_);
  {
    auto held = first.value()->lock(lock_name);
    ASSERT_TRUE(held);
    const auto refused = second.value()->lock(lock_name);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().number, EWOULDBLOCK);
  }
  EXPECT_TRUE(second.value()->lock(lock_name));
}

TEST_F(PosixDiskTest, ListingParsesFileNames) {
  auto opened = open_directory(path_);
  Disk& disk = *opened.value();
  for (const char* name :
       {"segment.0000000002", "segment.0000000010", "segment.0000000003.new", "checkpoint.0000000001",
        "checkpoint.0000000002.new", "geometry.0000000005", "lock", "segment.3", "segment.x",
        "segment.00000000011", "geometry.0000000005.new", "other"})
    ASSERT_TRUE(disk.create(name));
  auto listing = list_log(disk);
  ASSERT_TRUE(listing);
  using Numbers = std::vector<std::uint64_t>;
  EXPECT_EQ(listing.value().segments, (Numbers{2, 10}));
  EXPECT_EQ(listing.value().unfinished_segments, Numbers{3});
  EXPECT_EQ(listing.value().checkpoints, Numbers{1});
  EXPECT_EQ(listing.value().unfinished_checkpoints, Numbers{2});
  EXPECT_EQ(listing.value().geometries, Numbers{5});
}

TEST(DatabaseId, IsDifferentEachTime) {
  EXPECT_NE(new_database_id(), new_database_id());
}

}  // namespace
}  // namespace rtstdb::log::test
