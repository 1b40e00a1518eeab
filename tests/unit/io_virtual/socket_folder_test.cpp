#include "io/virtual/socket_folder.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace hil::io::virtual_bus {
namespace {

namespace fs = std::filesystem;

/// Uses a folder of the test in place of /tmp.
class SocketFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* const before = std::getenv("TMPDIR");
    before_ = before == nullptr ? "" : before;
    ::setenv("TMPDIR", base_.path().c_str(), 1);
  }
  void TearDown() override {
    before_.empty() ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", before_.c_str(), 1);
  }
  std::ptrdiff_t count() const { return std::distance(fs::directory_iterator(base_.path()), {}); }

  const tests::TemporaryFolder base_;
  std::string before_;
};

void put_socket(const fs::path& path) {
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un place{};
  place.sun_family = AF_UNIX;
  std::memcpy(place.sun_path, path.c_str(), path.string().size() + 1);
  EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&place), sizeof place), 0);
  ::close(fd);
}

TEST_F(SocketFolders, AreRemovedWithTheirSockets) {
  {
    SocketFolder folder = SocketFolder::make();
    put_socket(fs::path(folder.path()) / "car");
    const SocketFolder moved = std::move(folder);
    EXPECT_TRUE(fs::exists(moved.path()));
  }
  EXPECT_EQ(count(), 0);
}

TEST_F(SocketFolders, OnlyThoseOfKilledProcessesAreRemoved) {
  const SocketFolder in_use = SocketFolder::make();
  put_socket(fs::path(in_use.path()) / "car");
  const pid_t owner = ::fork();
  ASSERT_GE(owner, 0);
  if (owner == 0) {
    const SocketFolder abandoned = SocketFolder::make();
    put_socket(fs::path(abandoned.path()) / "car");
    ::kill(::getpid(), SIGKILL);
  }
  ::waitpid(owner, nullptr, 0);
  fs::create_directories(base_ / "hil-bus-foreign");
  std::ofstream(base_ / "hil-bus-foreign" / "file") << "content";
  fs::create_directories(base_ / "foreign");
  ASSERT_EQ(count(), 4);
  const SocketFolder next = SocketFolder::make();
  EXPECT_EQ(count(), 4) << "one removed, one added";
  EXPECT_TRUE(fs::exists(fs::path(in_use.path()) / "car"));
  EXPECT_TRUE(fs::exists(base_ / "hil-bus-foreign" / "file"));
  EXPECT_TRUE(fs::exists(next.path()));
}

}  // namespace
}  // namespace hil::io::virtual_bus
