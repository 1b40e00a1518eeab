#include "runtime/executive/machine.hpp"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace hil::executive {
namespace {

class FactsOfAMachine : public ::testing::Test {
 protected:
  void put(const std::string& file, const std::string& text) { root_.write(file, text + '\n'); }
  MachineState read() const { return read_machine_state(root_.path()); }

 private:
  tests::TemporaryFolder root_;
};

TEST_F(FactsOfAMachine, AreReadFromARealTimeMachine) {
  put("sys/kernel/realtime", "1");
  put("proc/sys/kernel/sched_rt_runtime_us", "-1");
  put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance");
  const MachineState facts = read();
  EXPECT_TRUE(facts.preempt_rt);
  EXPECT_EQ(facts.rt_runtime_us, -1);
  MachineState exact = facts;
  exact.timer_resolution_ns = 1;
  EXPECT_TRUE(timing_limits(exact, true).empty());
}

TEST_F(FactsOfAMachine, AreReadFromAnOrdinaryMachine) {
  put("proc/version", "Linux version 6.1.0 #1 SMP PREEMPT_DYNAMIC");
  put("proc/sys/kernel/sched_rt_runtime_us", "950000");
  put("proc/sys/kernel/sched_rt_period_us", "1000000");
  put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave");
  put("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave");
  MachineState facts = read();
  facts.timer_resolution_ns = 4'000'000;
  const auto limits = timing_limits(facts, true);
  ASSERT_EQ(limits.size(), 4U) << "each governor is named once";
  EXPECT_NE(limits[0].find("not PREEMPT_RT"), std::string::npos);
  EXPECT_NE(limits[1].find("4000000 ns"), std::string::npos);
  EXPECT_NE(limits[2].find("powersave"), std::string::npos);
  EXPECT_NE(limits[3].find("950000 of each 1000000 us"), std::string::npos);
  EXPECT_EQ(timing_limits(facts, false).size(), 3U) << "throttling concerns real-time threads only";
}

TEST_F(FactsOfAMachine, IncludePreemptRtByTheVersion) {
  put("proc/version", "Linux version 6.1.0-rt #1 SMP PREEMPT_RT Debian");
  EXPECT_TRUE(read().preempt_rt);
}

TEST_F(FactsOfAMachine, AreUnknownWithoutTheirFiles) {
  put("proc/sys/kernel/sched_rt_runtime_us", "noise");
  const MachineState facts = read();
  EXPECT_FALSE(facts.preempt_rt);
  EXPECT_FALSE(facts.rt_runtime_us.has_value());
  EXPECT_TRUE(facts.frequency_governors.empty());
}

}  // namespace
}  // namespace hil::executive
