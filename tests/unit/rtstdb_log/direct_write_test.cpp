// Which writes use direct I/O, and that all of them arrive. The test replaces pwrite, to count the calls and
// to refuse direct I/O as some file systems do.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <random>

#include "rtstdb/log/page_buffer.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

struct WriteCounts {
  int direct = 0, cached = 0;
};
thread_local WriteCounts writes;
thread_local bool refuse_direct = false;

}  // namespace

extern "C" ssize_t pwrite(int descriptor, const void* bytes, std::size_t count, off_t offset) {
  const bool direct = (::fcntl(descriptor, F_GETFL) & O_DIRECT) != 0;
  if (direct && refuse_direct) {
    errno = EINVAL;
    return -1;
  }
  ++(direct ? writes.direct : writes.cached);
  return ::syscall(SYS_pwrite64, descriptor, bytes, count, offset);
}

namespace rtstdb::log::test {
namespace {

constexpr std::size_t sector = 512;

class DirectWrite : public testing::Test {
 protected:
  DirectWrite() {
    disk_ = std::move(open_directory(folder_.path()).value());
    file_ = std::move(disk_->create("a").value());
    std::mt19937_64 random(1);
    for (std::byte& byte : memory_.bytes())
      byte = static_cast<std::byte>(random());
    writes = {};
    refuse_direct = false;
  }
  ~DirectWrite() override { refuse_direct = false; }

  /// Determined by a trial: whether single sectors, not only whole pages, can use direct I/O.
  int possible() const {
    const int probe = ::open((folder_ / "probe").c_str(), O_WRONLY | O_CREAT | O_DIRECT | O_CLOEXEC, 0600);
    if (probe < 0) return 0;
    const auto written = ::syscall(SYS_pwrite64, probe, memory_.bytes().data(), sector, sector);
    ::close(probe);
    return written == static_cast<long>(sector) ? 1 : 0;
  }
  void write(std::uint64_t offset, std::size_t from, std::size_t count) {
    const auto bytes = memory_.bytes().subspan(from, count);
    ASSERT_FALSE(file_->write(offset, bytes));
    if (expected_.size() < offset + count) expected_.resize(offset + count);
    std::memcpy(expected_.data() + offset, bytes.data(), count);
  }
  void expect_complete() {
    ASSERT_FALSE(file_->sync());
    const std::string written = hil::tests::content_of(folder_ / "a");
    ASSERT_EQ(written.size(), expected_.size());
    EXPECT_EQ(std::memcmp(written.data(), expected_.data(), written.size()), 0);
  }

  hil::tests::TemporaryFolder folder_;
  std::unique_ptr<Disk> disk_;
  std::unique_ptr<DiskFile> file_;
  PageBuffer memory_{1 << 20};
  std::vector<std::byte> expected_;
};

TEST_F(DirectWrite, WholeSectorsUseDirectIoIfPossible) {
  write(sector, 0, 8 * sector);
  write(9 * sector, 0, sector);
  write(10 * sector, 0, memory_.bytes().size());
  EXPECT_EQ(writes.direct, 3 * possible());
  EXPECT_EQ(writes.cached, 3 - 3 * possible());
  expect_complete();
}

TEST_F(DirectWrite, OtherWritesUseTheCache) {
  write(0, 0, 100);               // not a whole sector
  write(2 * sector, 0, 700);      // not whole sectors
  write(8 * sector + 8, 0, 512);  // unaligned offset
  write(16 * sector, 1, sector);  // unaligned memory
  EXPECT_EQ(writes.direct, 0);
  EXPECT_EQ(writes.cached, 4);
  expect_complete();
}

TEST_F(DirectWrite, DirectAndCachedWritesMix) {
  std::mt19937_64 random(2);
  for (int k = 0; k < 300; ++k) {
    const bool whole = random() % 2 == 0;
    const std::uint64_t offset = random() % 64 * sector + (whole ? 0 : random() % sector);
    const std::size_t count = whole ? (1 + random() % 16) * sector : 1 + random() % 5000;
    write(offset, random() % 128 * 4096, count);
  }
  EXPECT_GT(writes.cached, 100);
  EXPECT_GE(writes.direct, 100 * possible());
  expect_complete();
}

TEST_F(DirectWrite, RefusedDirectIoIsNotRetried) {
  refuse_direct = true;
  write(0, 0, 4 * sector);
  refuse_direct = false;
  write(4 * sector, 0, 4 * sector);
  EXPECT_EQ(writes.direct, 0);
  EXPECT_EQ(writes.cached, 2);
  expect_complete();
}

TEST(PageBuffer, IsPageAlignedAndZero) {
  for (const std::size_t bytes : {std::size_t{1}, std::size_t{4096}, std::size_t{5 << 20}}) {
    const PageBuffer pages(bytes);
    ASSERT_EQ(pages.bytes().size(), bytes);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(pages.bytes().data()) % disk_page_bytes, 0u);
    for (const std::byte byte : pages.bytes())
      ASSERT_EQ(byte, std::byte{0});
  }
}

}  // namespace
}  // namespace rtstdb::log::test
