// A process that is stopped and continued publishes no firm transaction late, reports no false miss, and
// measures the pauses.

#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <string>
#include <thread>

#include "tests/support/rounds.hpp"

namespace hil::stress {
namespace {

using namespace std::chrono_literals;

/// The program, with pipes to its standard input and output.
class Program {
 public:
  Program() {
    std::array<int, 2> in{};
    std::array<int, 2> out{};
    if (pipe(in.data()) != 0 || pipe(out.data()) != 0) throw std::runtime_error("no pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    for (const int end : {in[0], in[1], out[0], out[1]})
      posix_spawn_file_actions_addclose(&actions, end);
    std::string path = HIL_PAUSED_PROGRAM;
    std::array<char*, 2> arguments{path.data(), nullptr};
    const int error = posix_spawn(&id_, path.c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(in[0]);
    close(out[1]);
    if (error != 0) throw std::runtime_error("can not start " + path);
    input_ = in[1];
    output_ = fdopen(out[0], "r");
  }
  ~Program() {
    if (id_ > 0) {
      kill(id_, SIGKILL);
      waitpid(id_, nullptr, 0);
    }
    end_input();
    std::fclose(output_);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  std::string read_line() {
    std::array<char, 256> text{};
    return std::fgets(text.data(), text.size(), output_) != nullptr ? text.data() : "";
  }
  void stop_for(std::chrono::milliseconds time) {
    ASSERT_EQ(kill(id_, SIGSTOP), 0);
    int state = 0;
    ASSERT_EQ(waitpid(id_, &state, WUNTRACED), id_);
    ASSERT_TRUE(WIFSTOPPED(state));
    std::this_thread::sleep_for(time);
    ASSERT_EQ(kill(id_, SIGCONT), 0);
  }
  void end_input() {
    if (input_ >= 0) close(input_);
    input_ = -1;
  }
  int wait() {
    int state = 0;
    waitpid(id_, &state, 0);
    id_ = -1;
    return state;
  }

 private:
  pid_t id_ = -1;
  int input_ = -1;
  std::FILE* output_ = nullptr;
};

TEST(PausedProcess, HasNoLateCommitAndNoFalseMiss) {
  Program program;
  ASSERT_EQ(program.read_line(), "ready\n");
  const int stops = static_cast<int>(tests::rounds(6, 200));
  for (int k = 0; k < stops; ++k) {
    // In any state of a transaction.
    std::this_thread::sleep_for(std::chrono::microseconds(20'000 + 137 * k));
    program.stop_for(150ms);
  }
  program.end_input();
  const std::string line = program.read_line();
  std::cout << line;
  ASSERT_EQ(program.wait(), 0);
  unsigned long committed = 0;
  unsigned long missed = 0;
  unsigned long late_commits = 1;
  unsigned long false_misses = 1;
  long long longest_pause_ms = 0;
  long long max_lateness_ms = 0;
  ASSERT_EQ(
      std::sscanf(line.c_str(),
                  "committed %lu missed %lu late_commits %lu false_misses %lu longest_pause_ms %lld "
                  "max_lateness_ms %lld",
                  &committed, &missed, &late_commits, &false_misses, &longest_pause_ms, &max_lateness_ms),
      6);
  EXPECT_EQ(late_commits, 0u);
  EXPECT_EQ(false_misses, 0u);
  EXPECT_GT(committed, 0u);
  EXPECT_GE(longest_pause_ms, 150);
  EXPECT_LE(max_lateness_ms, longest_pause_ms);
}

}  // namespace
}  // namespace hil::stress
