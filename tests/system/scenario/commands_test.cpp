// The commands that need no run: check, keys, report, doctor.

#include <gtest/gtest.h>

#include "tests/system/scenario/hil.hpp"

namespace hil::scenario_test {
namespace {

TEST(Commands, CheckCountsTheParts) {
  const Ended ended = run_hil({"check", crossing()});
  EXPECT_EQ(ended.code, 0) << ended.errors;
  for (const char* words : {"5 tasks", "1 CAN bus", "1 Modbus unit", "3 expectations", "no mistakes"})
    EXPECT_NE(ended.output.find(words), std::string::npos) << words << " is not in: " << ended.output;
}

TEST(Commands, KeysDescribesModuleTypesAndAllParts) {
  const Ended ended = run_hil({"keys"});
  EXPECT_EQ(ended.code, 0);
  for (const char* type : {"vehicles", "laser_scanner", "detectors", "collision"}) {
    EXPECT_NE(ended.output.find(std::string("module type `").append(type).append("`")), std::string::npos)
        << type;
  }
  for (const char* word : {"base_rate", "watchdog", "scan_rate", "columns", "counter", "checksum",
                           "heartbeat", "run_time", "stop_line", "start_timeout", "within"}) {
    EXPECT_NE(ended.output.find(std::string("`").append(word).append("`")), std::string::npos) << word;
  }
}

TEST(Commands, OutputThatCanNotBeWrittenIsExitCode4) {
  const Folder folder;
  const Ended run =
      run_hil({"run", crossing(), "--out", folder / "out", "--set", "dut.command=[no-such-program]"});
  ASSERT_TRUE(std::filesystem::exists(folder / "out/report.json")) << run.output << run.errors;
  const std::vector<std::vector<std::string>> commands{
      {"keys"}, {"check", crossing()}, {"report", folder / "out"}, {"doctor"}};
  for (const std::vector<std::string>& command : commands) {
    const Ended ended = Program(joined({{"sh", "-c", "exec \"$@\" > /dev/full", "sh"}, hil(command)})).wait();
    EXPECT_EQ(ended.code, 4) << command.front();
    EXPECT_EQ(ended.errors,
              "hil " + command.front() + ": the output can not be written: No space left on device\n");
  }
}

TEST(Commands, LackOfMemoryIsReported) {
  const Folder folder;
  std::string many = "world:\n  entities:\n";
  for (int i = 0; i < 30'000; ++i)
    many += "    - {name: a, mask: [b, c, d]}\n";
  write_text(folder / "many.yaml", many);
  const Ended ended = Program(joined({{"sh", "-c", "ulimit -v 60000; exec \"$@\"", "sh"},
                                      hil({"check", folder / "many.yaml"})}))
                          .wait();
  EXPECT_EQ(ended.code, 70);
  EXPECT_EQ(ended.errors,
            "hil: memory ran out; raise its limit (ulimit -v, ulimit -d) or make memory free\n");
}

TEST(Doctor, ReportsTheParts) {
  const Ended ended = run_hil({"doctor"});
  EXPECT_EQ(ended.code, 0) << ended.output;
  for (const char* topic : {"Vulkan device", "opens on", "SocketCAN", "SCHED_FIFO", "wake-up latency"})
    EXPECT_NE(ended.output.find(topic), std::string::npos) << topic << " is not in: " << ended.output;
}

}  // namespace
}  // namespace hil::scenario_test
