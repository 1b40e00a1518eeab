#include "io/virtual/process.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <thread>

namespace hil::io::process {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

ChildConfig shell(const std::string& script) {
  return {.name = "dut",
          .command = {"sh", "-c", script},
          .search_folders = {},
          .working_folder = {},
          .output_file = {}};
}

std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// A shell that has run `setup` when this returns, and then runs for ever.
std::unique_ptr<Child> endless_shell(const std::string& setup, const std::filesystem::path& output) {
  ChildConfig config = shell(setup + "; echo ready; while :; do sleep 0.01; done");
  config.output_file = output;
  auto child = std::make_unique<Child>(config);
  while (content_of(output) != "ready\n")
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return child;
}

std::filesystem::path scratch(const char* name) {
  return std::filesystem::path(::testing::TempDir()) / (std::string(name) + "-" + std::to_string(::getpid()));
}

bool alive(pid_t pid) {
  return ::kill(pid, 0) == 0 || errno != ESRCH;
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
  const auto output = scratch("ready");
  const auto polite = endless_shell("trap 'exit 7' TERM", output);
  EXPECT_EQ(polite->stop(5 * second_ns), (Exit{Exit::How::exited, 7, false}));
  std::filesystem::remove(output);
  const auto stubborn = endless_shell("trap '' TERM", output);
  const Exit& exit = stubborn->stop(second_ns / 10);
  EXPECT_EQ(exit, (Exit{Exit::How::killed, SIGKILL, true}));
  EXPECT_EQ(stubborn->stop(0), exit) << "again is the same";
  std::filesystem::remove(output);
}

TEST(Process, WritesItsOutputToAFile) {
  const auto file = scratch("output");
  ChildConfig config = shell("echo out; echo err >&2; pwd; cat");
  config.output_file = file;
  config.working_folder = "/";
  {
    Child child(config);
    ASSERT_TRUE(child.wait_for_exit(5 * second_ns)) << "stdin is empty";
  }
  EXPECT_EQ(content_of(file), "out\nerr\n/\n");
  std::filesystem::remove(file);
}

TEST(Process, ReportsWhyItCanNotBeStarted) {
  const auto words_of = [](const ChildConfig& config) -> std::string {
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
  const std::string missing = words_of(config);
  EXPECT_NE(missing.find("process 'dut': no program 'hil-no-such-program'"), std::string::npos) << missing;
  EXPECT_NE(missing.find("'/opt'"), std::string::npos) << missing;
  config.command = {"/nowhere/program"};
  EXPECT_NE(words_of(config).find("No such file"), std::string::npos);
  config.command = {"/etc/passwd"};
  EXPECT_NE(words_of(config).find("ermission denied"), std::string::npos) << words_of(config);
  config = shell("exit 0");
  config.working_folder = "/nowhere";
  EXPECT_NE(words_of(config).find("No such file"), std::string::npos);
  config = shell("exit 0");
  config.output_file = "/nowhere/file";
  EXPECT_NE(words_of(config).find("output file"), std::string::npos);
}

TEST(Process, SearchesTheGivenFoldersFirst) {
  const auto folder = scratch("folder");
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "true") << "#!/bin/sh\nexit 9\n";
  std::filesystem::permissions(folder / "true", std::filesystem::perms::owner_all);
  Child child({.name = "dut",
               .command = {"true"},
               .search_folders = {folder},
               .working_folder = {},
               .output_file = {}});
  ASSERT_TRUE(child.wait_for_exit(5 * second_ns));
  EXPECT_EQ(child.exit().code, 9);
  std::filesystem::remove_all(folder);
}

TEST(Process, KillsItsDescendantsWhenItEnds) {
  const auto file = scratch("grandchild");
  Child child(shell("sleep 1000 & echo $! > " + file.string() + "; exit 0"));
  ASSERT_TRUE(child.wait_for_exit(5 * second_ns));
  const int grandchild = std::stoi(content_of(file));
  for (int wait = 0; wait < 500 && alive(grandchild); ++wait) {
    // This process can not reap it; it has ended, or is a zombie.
    if (content_of("/proc/" + std::to_string(grandchild) + "/stat").find(") Z ") != std::string::npos) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_LT(wait, 499) << "it still lives";
  }
  std::filesystem::remove(file);
}

TEST(Process, DiesWithItsParentEvenWhenThatIsKilled) {
  const auto file = scratch("orphan");
  const pid_t parent = ::fork();
  ASSERT_GE(parent, 0);
  if (parent == 0) {
    const Child child(shell("echo $$ > " + file.string() + ".tmp; mv " + file.string() + ".tmp " +
                            file.string() + "; sleep 1000"));
    ::pause();
    ::_exit(0);
  }
  for (int wait = 0; wait < 500 && !std::filesystem::exists(file); ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const int child = std::stoi(content_of(file));
  EXPECT_TRUE(alive(child));
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  bool gone = false;
  for (int wait = 0; wait < 500 && !gone; ++wait) {
    gone = !alive(child) ||
           content_of("/proc/" + std::to_string(child) + "/stat").find(") Z ") != std::string::npos;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(gone);
  std::filesystem::remove(file);
}

/// A process in a group that nobody signals any more; also a zombie that waits for another's reaping is gone.
bool gone_soon(pid_t pid) {
  for (int wait = 0; wait < 500; ++wait) {
    if (!alive(pid)) return true;
    if (content_of("/proc/" + std::to_string(pid) + "/stat").find(") Z ") != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST(Process, WhatItStartedDiesWhenItsParentIsKilled) {
  const auto file = scratch("grandchild-of-killed");
  const pid_t parent = ::fork();
  ASSERT_GE(parent, 0);
  if (parent == 0) {
    const std::string name = file.string();
    const Child child(
        shell("sleep 1000 & echo $! > " + name + ".tmp; mv " + name + ".tmp " + name + "; wait"));
    ::pause();
    ::_exit(0);
  }
  for (int wait = 0; wait < 500 && !std::filesystem::exists(file); ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const int grandchild = std::stoi(content_of(file));
  EXPECT_TRUE(alive(grandchild));
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  EXPECT_TRUE(gone_soon(grandchild));
  std::filesystem::remove(file);
}

TEST(Process, LeavesNoChildBehind) {
  Child child(shell("exit 0"));
  ASSERT_TRUE(child.wait_for_exit(5 * second_ns));
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

TEST(Process, TruncatesEndlessOutputWithANote) {
  const auto file = scratch("endless");
  ChildConfig config = shell("echo first; exec yes 'and so on'");
  config.output_file = file;
  {
    Child child(config);
    for (int wait = 0; wait < 1000 && std::filesystem::file_size(file) <= OutputKeeper::kept_bytes; ++wait)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(child.running()) << "it is neither blocked nor ended";
    EXPECT_EQ(child.stop(5 * second_ns), (Exit{Exit::How::killed, SIGTERM, false}));
  }
  const std::string kept = content_of(file);
  EXPECT_TRUE(kept.starts_with("first\nand so on\n"));
  EXPECT_TRUE(kept.ends_with("[hil: this program printed more than 16 MiB; the rest was left out]\n"));
  EXPECT_LT(kept.size(), OutputKeeper::kept_bytes + 100);
  std::filesystem::remove(file);
}

TEST(Process, KeepsAllOfALargeOutputThatFits) {
  const auto file = scratch("large");
  ChildConfig config = shell("head -c 3000000 /dev/zero; echo end");
  config.output_file = file;
  {
    Child child(config);
    ASSERT_TRUE(child.wait_for_exit(30 * second_ns));
  }
  EXPECT_EQ(std::filesystem::file_size(file), 3'000'004U);
  EXPECT_TRUE(content_of(file).ends_with("end\n"));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace hil::io::process
