#include "io/virtual/process.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>

#include "tests/support/eventually.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::io::process {
namespace {

using tests::content_of;
using tests::eventually;
using tests::TemporaryFolder;

constexpr std::int64_t second_ns = 1'000'000'000;

ChildConfig shell(const std::string& script) {
  return {.name = "dut",
          .command = {"sh", "-c", script},
          .search_folders = {},
          .working_folder = {},
          .output_file = {}};
}

/// A shell that has run `setup` and runs until it is stopped.
std::unique_ptr<Child> endless_shell(const std::string& setup) {
  const TemporaryFolder folder;
  ChildConfig config = shell(setup + "; echo ready; while :; do sleep 0.01; done");
  config.output_file = folder / "output";
  auto child = std::make_unique<Child>(config);
  EXPECT_TRUE(eventually([&] { return content_of(config.output_file) == "ready\n"; }));
  return child;
}

/// Also of a zombie, which its parent has not reaped yet.
bool has_ended(pid_t pid) {
  if (::kill(pid, 0) != 0 && errno == ESRCH) return true;
  return content_of("/proc/" + std::to_string(pid) + "/stat").find(") Z ") != std::string::npos;
}

TEST(Process, ReportsHowItEnded) {
  Child three(shell("exit 3"));
  ASSERT_TRUE(three.wait_for_exit(5 * second_ns));
  EXPECT_EQ(three.exit(), (Exit{Exit::How::exited, 3, false}));
  EXPECT_FALSE(three.exit().success());
  EXPECT_EQ(describe(three.exit()), "exited with code 3");
  Child zero(shell("exit 0"));
  ASSERT_TRUE(zero.wait_for_exit(5 * second_ns));
  EXPECT_TRUE(zero.exit().success());
  Child crashed(shell("kill -SEGV $$"));
  ASSERT_TRUE(crashed.wait_for_exit(5 * second_ns));
  EXPECT_EQ(crashed.exit().how, Exit::How::killed);
  EXPECT_EQ(describe(crashed.exit()), "was ended by signal 11 (Segmentation fault)");
}

TEST(Process, DescriptorBecomesReadableWhenItEnds) {
  Child child(shell("sleep 0.05"));
  pollfd watched{child.exit_fd(), POLLIN, 0};
  EXPECT_EQ(::poll(&watched, 1, 0), 0);
  EXPECT_TRUE(child.running());
  EXPECT_EQ(::poll(&watched, 1, 5000), 1);
  EXPECT_FALSE(child.running());
}

TEST(Process, StopTerminatesAndThenKills) {
  EXPECT_EQ(endless_shell("trap 'exit 7' TERM")->stop(5 * second_ns), (Exit{Exit::How::exited, 7, false}));
  const auto ignoring = endless_shell("trap '' TERM");
  const Exit& exit = ignoring->stop(second_ns / 10);
  EXPECT_EQ(exit, (Exit{Exit::How::killed, SIGKILL, true}));
  EXPECT_EQ(ignoring->stop(0), exit) << "the second stop";
}

TEST(Process, WritesItsOutputToAFile) {
  const TemporaryFolder folder;
  ChildConfig config = shell("echo out; echo err >&2; pwd; cat");
  config.output_file = folder / "output";
  config.working_folder = "/";
  {
    Child child(config);
    ASSERT_TRUE(child.wait_for_exit(5 * second_ns)) << "stdin is empty";
  }
  EXPECT_EQ(content_of(config.output_file), "out\nerr\n/\n");
}

TEST(Process, ReportsWhyItCanNotBeStarted) {
  const auto refusal_of = [](const ChildConfig& config) -> std::string {
    try {
      const Child child(config);
    } catch (const DeviceError& error) {
      return error.what();
    }
    return "it started";
  };
  ChildConfig config{.name = "dut",
                     .command = {"hil-no-such-program"},
                     .search_folders = {"/opt"},
                     .working_folder = {},
                     .output_file = {}};
  const std::string missing = refusal_of(config);
  EXPECT_NE(missing.find("process 'dut': no program 'hil-no-such-program'"), std::string::npos) << missing;
  EXPECT_NE(missing.find("'/opt'"), std::string::npos) << missing;
  config.command = {"/nowhere/program"};
  EXPECT_NE(refusal_of(config).find("No such file"), std::string::npos);
  config.command = {"/etc/passwd"};
  EXPECT_NE(refusal_of(config).find("ermission denied"), std::string::npos) << refusal_of(config);
  config = shell("exit 0");
  config.working_folder = "/nowhere";
  EXPECT_NE(refusal_of(config).find("No such file"), std::string::npos);
  config = shell("exit 0");
  config.output_file = "/nowhere/file";
  EXPECT_NE(refusal_of(config).find("output file"), std::string::npos);
}

TEST(Process, SearchesTheGivenFoldersFirst) {
  const TemporaryFolder folder;
  std::ofstream(folder / "true") << "#!/bin/sh\nexit 9\n";
  std::filesystem::permissions(folder / "true", std::filesystem::perms::owner_all);
  Child child({.name = "dut",
               .command = {"true"},
               .search_folders = {folder.path()},
               .working_folder = {},
               .output_file = {}});
  ASSERT_TRUE(child.wait_for_exit(5 * second_ns));
  EXPECT_EQ(child.exit().code, 9);
}

/// The number in a file that a child writes; waits for it.
pid_t pid_in(const std::filesystem::path& file) {
  EXPECT_TRUE(eventually([&] { return content_of(file).ends_with('\n'); }));
  return std::stoi(content_of(file));
}

TEST(Process, KillsItsDescendantsWhenItEnds) {
  const TemporaryFolder folder;
  Child child(shell("sleep 1000 & echo $! > " + (folder / "pid").string() + "; exit 0"));
  ASSERT_TRUE(child.wait_for_exit(5 * second_ns));
  const pid_t descendant = pid_in(folder / "pid");
  EXPECT_TRUE(eventually([&] { return has_ended(descendant); }));
}

TEST(Process, EndsWithItsDescendantsWhenItsParentIsKilled) {
  for (const std::string script : {"echo $$ > pid; sleep 1000", "sleep 1000 & echo $! > pid; wait"}) {
    SCOPED_TRACE(script);
    const TemporaryFolder folder;
    const pid_t parent = ::fork();
    ASSERT_GE(parent, 0);
    if (parent == 0) {
      ChildConfig config = shell(script);
      config.working_folder = folder.path();
      const Child child(config);
      folder.write("is started", "");
      ::pause();
      ::_exit(0);
    }
    const pid_t descendant = pid_in(folder / "pid");
    // From here on the descendants end with the parent; the script may write its file before.
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(folder / "is started"); }));
    EXPECT_FALSE(has_ended(descendant));
    ::kill(parent, SIGKILL);
    ::waitpid(parent, nullptr, 0);
    EXPECT_TRUE(eventually([&] { return has_ended(descendant); }));
  }
}

TEST(Process, LeavesNoChildBehind) {
  Child child(shell("exit 0"));
  ASSERT_TRUE(child.wait_for_exit(5 * second_ns));
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

TEST(Process, TruncatesEndlessOutputWithANote) {
  const TemporaryFolder folder;
  const auto file = folder / "output";
  ChildConfig config = shell("echo first; exec yes 'and so on'");
  config.output_file = file;
  {
    Child child(config);
    EXPECT_TRUE(eventually([&] { return std::filesystem::file_size(file) > OutputKeeper::kept_bytes; }));
    EXPECT_TRUE(child.running());
    EXPECT_EQ(child.stop(5 * second_ns), (Exit{Exit::How::killed, SIGTERM, false}));
  }
  const std::string kept = content_of(file);
  EXPECT_TRUE(kept.starts_with("first\nand so on\n"));
  EXPECT_TRUE(kept.ends_with("[hil: this program printed more than 16 MiB; the rest was left out]\n"));
  EXPECT_LT(kept.size(), OutputKeeper::kept_bytes + 100);
}

TEST(Process, KeepsAllOfALargeOutputThatFits) {
  const TemporaryFolder folder;
  const auto file = folder / "output";
  ChildConfig config = shell("head -c 3000000 /dev/zero; echo end");
  config.output_file = file;
  {
    Child child(config);
    ASSERT_TRUE(child.wait_for_exit(30 * second_ns));
  }
  EXPECT_EQ(std::filesystem::file_size(file), 3'000'004U);
  EXPECT_TRUE(content_of(file).ends_with("end\n"));
}

}  // namespace
}  // namespace hil::io::process
