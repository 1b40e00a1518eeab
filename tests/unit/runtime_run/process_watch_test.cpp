#include "runtime/run/process_watch.hpp"

#include <gtest/gtest.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <mutex>
#include <system_error>
#include <thread>

#include "tests/unit/runtime_run/run_test.hpp"

namespace hil::run {
namespace {

using testing::Folder;
using namespace std::chrono_literals;

ProcessWatch::Program shell(const std::string& name, const std::string& script, bool safe_on_exit = true) {
  return {.child = {.name = name,
                    .command = {"sh", "-c", script},
                    .search_folders = {},
                    .working_folder = {},
                    .output_file = {}},
          .safe_on_exit = safe_on_exit};
}

template <typename Condition>
bool comes_true(Condition condition) {
  const auto until = std::chrono::steady_clock::now() + 20s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(2ms);
  }
  return true;
}

class Deaths {
 public:
  std::function<void(const ProcessExit&)> watcher() {
    return [this](const ProcessExit& exit_state) {
      const std::lock_guard lock(mutex_);
      exits_.push_back(exit_state);
    };
  }
  std::vector<ProcessExit> all() const {
    const std::lock_guard lock(mutex_);
    return exits_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<ProcessExit> exits_;
};

/// Its connection was seen to close, and the run ended, before it could be seen to end.
TEST(ProcessWatch, WaitsForTheEndOfOneThatIsAboutToEnd) {
  Deaths deaths;
  ProcessWatch watch(
      {shell("plc", "sleep 100"), shell("helper", "exit 0", false), shell("dut", "sleep 0.5; kill -9 $$")},
      [] { return 5; });
  {
    const ProcessWatch::Watching watching = watch.watch(deaths.watcher(), {});
    ASSERT_TRUE(comes_true([&] { return deaths.all().size() == 1; })) << "one that nobody needs";
    watch.end_watch_after_exit(20s);
  }
  ASSERT_EQ(deaths.all().size(), 2u);
  EXPECT_EQ(deaths.all().back().name, "dut");
  EXPECT_NE(deaths.all().back().exit.find("signal 9"), std::string::npos) << deaths.all().back().exit;
}

TEST(ProcessWatch, TellsOfAProgramThatEndsByItself) {
  Deaths deaths;
  std::atomic<std::int64_t> now_ns{0};
  ProcessWatch watch({shell("plc", "sleep 100"), shell("dut", "sleep 0.1; exit 3", false)},
                     [&] { return now_ns.load(); });
  now_ns.store(1'234);
  const auto watching = watch.watch(deaths.watcher(), {});
  ASSERT_TRUE(comes_true([&] { return !deaths.all().empty(); }));
  const auto seen = deaths.all();
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].name, "dut");
  EXPECT_EQ(seen[0].exit, "exited with code 3");
  EXPECT_EQ(seen[0].ended_at_ns, 1'234);
  EXPECT_TRUE(seen[0].ended_early);
  EXPECT_FALSE(seen[0].safe_on_exit);
  const auto exits = watch.stop();
  ASSERT_EQ(exits.size(), 2U);
  EXPECT_EQ(exits[0].name, "plc");
  EXPECT_FALSE(exits[0].ended_early);
  EXPECT_TRUE(exits[0].safe_on_exit);
  EXPECT_EQ(exits[1].exit, "exited with code 3");
  EXPECT_TRUE(exits[1].ended_early);
  EXPECT_EQ(deaths.all().size(), 1U) << "told twice, or of its own stop";
}

TEST(ProcessWatch, TellsOfEachOfSeveralDeathsOnce) {
  Deaths deaths;
  ProcessWatch watch({shell("a", "exit 0"), shell("b", "kill -KILL $$"), shell("c", "sleep 0.2; exit 1")},
                     [] { return std::int64_t{0}; });
  const auto watching = watch.watch(deaths.watcher(), {});
  ASSERT_TRUE(comes_true([&] { return deaths.all().size() == 3; }));
  const auto exits = watch.stop();
  EXPECT_EQ(deaths.all().size(), 3U);
  EXPECT_EQ(exits[0].exit, "exited with code 0");
  EXPECT_EQ(exits[1].exit, "was ended by signal 9 (Killed)");
  EXPECT_EQ(exits[2].exit, "exited with code 1");
}

TEST(ProcessWatch, StopsAllAndTellsTheirFatesInTheirOrder) {
  const Folder folder;
  const std::string log = (folder.path() / "ends").string();
  const auto program = [&](const std::string& name) {
    return shell(name, "trap 'echo " + name + " >> " + log + "; exit 0' TERM; echo up >> " +
                           (folder.path() / ("up-" + name)).string() + "; while :; do sleep 0.01; done");
  };
  ProcessWatch watch({program("first"), program("second"), program("third")}, [] { return std::int64_t{0}; });
  for (const char* name : {"up-first", "up-second", "up-third"})
    ASSERT_TRUE(comes_true([&] { return folder.read(name) == "up\n"; }));
  const auto watching = watch.watch({}, {});
  const auto exits = watch.stop();
  EXPECT_EQ(folder.read("ends"), "first\nsecond\nthird\n");
  ASSERT_EQ(exits.size(), 3U);
  EXPECT_EQ(exits[0].name, "first");
  EXPECT_EQ(exits[2].name, "third");
  for (const ProcessExit& exit_state : exits) {
    EXPECT_EQ(exit_state.exit, "exited with code 0");
    EXPECT_FALSE(exit_state.ended_early);
  }
  EXPECT_EQ(watch.stop().size(), 3U) << "a second stop tells the same";
}

TEST(ProcessWatch, WhatEndsAfterTheWatchHasNotEndedEarly) {
  Deaths deaths;
  ProcessWatch watch({shell("dut", "trap 'exit 0' TERM; while :; do sleep 0.01; done")},
                     [] { return std::int64_t{0}; });
  const auto watching = watch.watch(deaths.watcher(), {});
  watch.end_watch();
  const auto exits = watch.stop();
  EXPECT_FALSE(exits[0].ended_early);
  EXPECT_TRUE(deaths.all().empty());
}

TEST(ProcessWatch, NamesTheFirstThatIsDeadBeforeTheWatch) {
  ProcessWatch watch({shell("plc", "sleep 100"), shell("dut", "exit 7")}, [] { return std::int64_t{0}; });
  std::string dead;
  ASSERT_TRUE(comes_true([&] { return !(dead = watch.first_ended()).empty(); }));
  EXPECT_EQ(dead, "dut exited with code 7");
}

TEST(ProcessWatch, CommandsAreShownAsTheyWereGiven) {
  ProcessWatch watch({shell("dut", "sleep 100")}, [] { return std::int64_t{0}; });
  EXPECT_EQ(watch.stop()[0].command, "sh -c sleep 100");
}

TEST(ProcessWatch, AProgramThatCanNotBeStartedStopsThoseBeforeIt) {
  const Folder folder;
  ProcessWatch::Program missing = shell("missing", "");
  missing.child.command = {"hil-there-is-no-such-program"};
  const std::string pid_file = (folder.path() / "pid").string();
  const auto first = shell("first", "echo $$ > " + pid_file + "; sleep 100");
  try {
    ProcessWatch watch({first, missing}, [] { return std::int64_t{0}; });
    FAIL() << "no error";
  } catch (const io::DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("hil-there-is-no-such-program"), std::string::npos)
        << error.what();
  }
  // It may have been ended before it wrote its number.
  const std::string pid = folder.read("pid");
  if (!pid.empty()) {
    EXPECT_EQ(::kill(std::stoi(pid), 0), -1);
    EXPECT_EQ(errno, ESRCH);
  }
}

TEST(ProcessWatch, EndsWithItsScopeWhenARunThrows) {
  Deaths deaths;
  ProcessWatch watch({shell("dut", "sleep 100")}, [] { return std::int64_t{0}; });
  EXPECT_THROW(
      {
        const auto watching = watch.watch(deaths.watcher(), {});
        throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
      },
      std::system_error);
  ASSERT_EQ(::kill(watch.process_of("dut"), SIGKILL), 0);
  EXPECT_FALSE(watch.stop()[0].ended_early);
  EXPECT_TRUE(deaths.all().empty()) << "what it told might be gone";
}

TEST(ProcessWatch, CallsOnceASecond) {
  std::atomic<int> calls{0};
  ProcessWatch watch({}, [] { return std::int64_t{0}; });
  const auto began = std::chrono::steady_clock::now();
  const auto watching = watch.watch({}, [&] { calls.fetch_add(1); });
  ASSERT_TRUE(comes_true([&] { return calls.load() == 2; }));
  EXPECT_GE(std::chrono::steady_clock::now() - began, 1'990ms);
  watch.stop();
  const int after = calls.load();
  std::this_thread::sleep_for(1'100ms);  // longer than the time between two calls
  EXPECT_EQ(calls.load(), after);
}

}  // namespace
}  // namespace hil::run
