#include "runtime/run/process_watch.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <mutex>
#include <system_error>
#include <thread>

#include "tests/support/eventually.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

using tests::eventually;
using tests::TemporaryFolder;
using namespace std::chrono_literals;

ProcessWatch::Program shell(const std::string& name, const std::string& script, bool safe_on_exit = true) {
  return {.child = {.name = name,
                    .command = {"sh", "-c", script},
                    .search_folders = {},
                    .working_folder = {},
                    .output_file = {}},
          .safe_on_exit = safe_on_exit};
}

class ExitRecorder {
 public:
  std::function<void(const ProcessExit&)> callback() {
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

/// The run ends since a connection closed, before the end of the program at its other side is detected.
TEST(ProcessWatch, WaitsForAProgramThatIsAboutToEnd) {
  ExitRecorder recorder;
  ProcessWatch watch(
      {shell("plc", "sleep 100"), shell("helper", "exit 0", false), shell("dut", "sleep 0.5; kill -9 $$")},
      [] { return 5; });
  {
    const ProcessWatch::Watching watching = watch.watch(recorder.callback(), {});
    ASSERT_TRUE(eventually([&] { return recorder.all().size() == 1; }))
        << "a program that the run does not need";
    watch.end_watch_after_exit(20s);
  }
  ASSERT_EQ(recorder.all().size(), 2u);
  EXPECT_EQ(recorder.all().back().name, "dut");
  EXPECT_NE(recorder.all().back().exit.find("signal 9"), std::string::npos) << recorder.all().back().exit;
}

TEST(ProcessWatch, ReportsAProgramThatEnds) {
  ExitRecorder recorder;
  std::atomic<std::int64_t> now_ns{0};
  ProcessWatch watch({shell("plc", "sleep 100"), shell("dut", "sleep 0.1; exit 3", false)},
                     [&] { return now_ns.load(); });
  now_ns.store(1'234);
  const auto watching = watch.watch(recorder.callback(), {});
  ASSERT_TRUE(eventually([&] { return !recorder.all().empty(); }));
  const auto seen = recorder.all();
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].name, "dut");
  EXPECT_EQ(seen[0].exit, "exited with code 3");
  EXPECT_EQ(seen[0].ended_at_ns, 1'234);
  EXPECT_TRUE(seen[0].ended_early);
  EXPECT_FALSE(seen[0].safe_on_exit);
  const auto exits = watch.stop();
  ASSERT_EQ(exits.size(), 2U);
  EXPECT_EQ(exits[0].name, "plc");
  EXPECT_EQ(exits[0].command, "sh -c sleep 100");
  EXPECT_FALSE(exits[0].ended_early);
  EXPECT_TRUE(exits[0].safe_on_exit);
  EXPECT_EQ(exits[1].exit, "exited with code 3");
  EXPECT_TRUE(exits[1].ended_early);
  EXPECT_EQ(recorder.all().size(), 1U) << "reported twice, or its stop was reported";
}

TEST(ProcessWatch, ReportsEachEndOnce) {
  ExitRecorder recorder;
  ProcessWatch watch({shell("a", "exit 0"), shell("b", "kill -KILL $$"), shell("c", "sleep 0.2; exit 1")},
                     [] { return std::int64_t{0}; });
  const auto watching = watch.watch(recorder.callback(), {});
  ASSERT_TRUE(eventually([&] { return recorder.all().size() == 3; }));
  const auto exits = watch.stop();
  EXPECT_EQ(recorder.all().size(), 3U);
  EXPECT_EQ(exits[0].exit, "exited with code 0");
  EXPECT_EQ(exits[1].exit, "was ended by signal 9 (Killed)");
  EXPECT_EQ(exits[2].exit, "exited with code 1");
}

TEST(ProcessWatch, StopsProgramsInOrderAndReturnsTheirExits) {
  const TemporaryFolder folder;
  const std::string log = (folder.path() / "ends").string();
  const auto program = [&](const std::string& name) {
    return shell(name, "trap 'echo " + name + " >> " + log + "; exit 0' TERM; echo up >> " +
                           (folder.path() / ("up-" + name)).string() + "; while :; do sleep 0.01; done");
  };
  ProcessWatch watch({program("first"), program("second"), program("third")}, [] { return std::int64_t{0}; });
  for (const char* name : {"up-first", "up-second", "up-third"})
    ASSERT_TRUE(eventually([&] { return folder.read(name) == "up\n"; }));
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
  EXPECT_EQ(watch.stop().size(), 3U) << "a second stop returns the same";
}

TEST(ProcessWatch, ProgramsThatEndAfterTheWatchDidNotEndEarly) {
  ExitRecorder recorder;
  ProcessWatch watch({shell("dut", "trap 'exit 0' TERM; while :; do sleep 0.01; done")},
                     [] { return std::int64_t{0}; });
  const auto watching = watch.watch(recorder.callback(), {});
  watch.end_watch();
  const auto exits = watch.stop();
  EXPECT_FALSE(exits[0].ended_early);
  EXPECT_TRUE(recorder.all().empty());
}

TEST(ProcessWatch, ProgramThatAFaultKillsEndsAtThatInstant) {
  std::atomic<std::int64_t> now_ns{7};
  ExitRecorder recorder;
  ProcessWatch watch({shell("ecu", "sleep 100"), shell("spare", "sleep 100"), shell("plc", "sleep 100")},
                     [&] { return now_ns.load(); });
  const std::string crash = "crash", last = "last";
  {
    const ProcessWatch::Watching watching = watch.watch(recorder.callback(), {});
    watch.kill_for_fault(0, crash);
    now_ns = 9;
    ASSERT_TRUE(eventually([&] { return recorder.all().size() == 1; }));
    EXPECT_EQ(recorder.all()[0].ended_at_ns, 7);
    EXPECT_EQ(recorder.all()[0].fault, "crash");
    EXPECT_FALSE(recorder.all()[0].safe_on_exit);
  }
  // Also where the watch does not find the end, since it is over.
  watch.kill_for_fault(1, last);
  now_ns = 11;
  const std::vector<ProcessExit> exits = watch.stop();
  EXPECT_TRUE(exits[1].ended_early);
  EXPECT_EQ(exits[1].ended_at_ns, 9);
  EXPECT_EQ(exits[1].fault, "last");
  EXPECT_EQ(exits[1].exit, "was ended by signal 9 (Killed)");
  EXPECT_FALSE(exits[2].ended_early);
}

TEST(ProcessWatch, NamesTheFirstThatEndedBeforeTheWatch) {
  ProcessWatch watch({shell("plc", "sleep 100"), shell("dut", "exit 7")}, [] { return std::int64_t{0}; });
  std::string ended;
  ASSERT_TRUE(eventually([&] { return !(ended = watch.first_ended()).empty(); }));
  EXPECT_EQ(ended, "dut");
}

TEST(ProcessWatch, KeepsTheLastLinesOfWhatEndedByItself) {
  const TemporaryFolder folder;
  const auto program = [&](const std::string& name, const std::string& script) {
    ProcessWatch::Program writing = shell(name, script);
    writing.child.output_file = folder.path() / (name + ".out");
    return writing;
  };
  const std::string killed = "killed";
  ProcessWatch watch(
      {program("dut", "seq 1 2000; printf 'a\\033[31mb\\n\\n  \\n'; echo no such bus >&2; exit 7"),
       program("silent", "exit 1"), program("killed", "echo x; sleep 100"),
       program("plc", "echo y; sleep 100"), program("long", "head -c 10000 /dev/zero | tr '\\0' x; exit 1")},
      [] { return std::int64_t{0}; });
  {
    ExitRecorder recorder;
    const ProcessWatch::Watching watching = watch.watch(recorder.callback(), {});
    ASSERT_TRUE(eventually([&] { return recorder.all().size() == 3; }));
    watch.kill_for_fault(2, killed);
    ASSERT_TRUE(eventually([&] { return recorder.all().size() == 4; }));
  }
  const std::vector<ProcessExit> exits = watch.stop();
  EXPECT_EQ(exits[0].last_lines,
            (std::vector<std::string>{"1998", "1999", "2000", "a\uFFFD[31mb", "no such bus"}));
  for (const std::size_t other : {1U, 2U, 3U, 4U})
    EXPECT_TRUE(exits[other].last_lines.empty()) << exits[other].name;
}

TEST(ProcessWatch, ProgramThatCanNotStartStopsTheEarlierOnes) {
  ProcessWatch::Program missing = shell("missing", "");
  missing.child.command = {"hil-there-is-no-such-program"};
  try {
    ProcessWatch watch({shell("first", "sleep 100"), missing}, [] { return std::int64_t{0}; });
    FAIL() << "no error";
  } catch (const io::DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("hil-there-is-no-such-program"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child process is left";
  EXPECT_EQ(errno, ECHILD);
}

TEST(ProcessWatch, EndsWithItsScopeWhenTheRunThrows) {
  ExitRecorder recorder;
  ProcessWatch watch({shell("dut", "sleep 100")}, [] { return std::int64_t{0}; });
  EXPECT_THROW(
      {
        const auto watching = watch.watch(recorder.callback(), {});
        throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
      },
      std::system_error);
  ASSERT_EQ(::kill(watch.process_of("dut"), SIGKILL), 0);
  EXPECT_FALSE(watch.stop()[0].ended_early);
  EXPECT_TRUE(recorder.all().empty()) << "its callback may no longer exist";
}

/// Real time is the subject: two calls are one second apart, and none follows the stop.
TEST(ProcessWatch, CallsItsCallbackOnceASecond) {
  std::atomic<int> calls{0};
  ProcessWatch watch({}, [] { return std::int64_t{0}; });
  const auto began = std::chrono::steady_clock::now();
  const auto watching = watch.watch({}, [&] { calls.fetch_add(1); });
  ASSERT_TRUE(eventually([&] { return calls.load() == 2; }));
  EXPECT_GE(std::chrono::steady_clock::now() - began, 1'990ms);
  watch.stop();
  const int after = calls.load();
  std::this_thread::sleep_for(1'100ms);  // real time is the subject: more than between two calls
  EXPECT_EQ(calls.load(), after);
}

}  // namespace
}  // namespace hil::run
