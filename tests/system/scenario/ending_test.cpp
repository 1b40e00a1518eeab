// Runs that end early: by the user, or since a program that they need is lost.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/silent_listener.hpp"

namespace hil::scenario_test {
namespace {

using std::chrono::duration;
using std::chrono::steady_clock;

/// A run of an hour that has begun and sends frames.
class LongRun {
 public:
  explicit LongRun(const std::string& clock, const std::vector<std::string>& more = {})
      : program_(hil(joined({{"run", crossing(), "--clock", clock, "--duration", "3600 s", "--out", out()},
                             few_beams(),
                             relaxed_timing(),
                             more}))) {
    const auto frames_are_logged = [&] {
      std::error_code absent;
      return std::filesystem::file_size(out() + "/can-car.log", absent) > 0 && !absent;
    };
    EXPECT_TRUE(eventually([&] { return frames_are_logged() || !program_.running(); }));
  }

  std::string out() const { return folder_ / "out"; }
  Program& program() noexcept { return program_; }
  /// Sends a signal to one of its programs.
  void signal_child(const std::string& child, int signal) {
    const auto pid = program_.child(child);
    ASSERT_TRUE(pid.has_value()) << child << " does not run";
    ASSERT_EQ(::kill(*pid, signal), 0);
    signalled_at_ = steady_clock::now();
  }
  void interrupt() {
    program_.signal(SIGINT);
    signalled_at_ = steady_clock::now();
  }
  Ended wait() {
    Ended ended = program_.wait();
    seconds_to_end_ = duration<double>(steady_clock::now() - signalled_at_).count();
    return ended;
  }
  double seconds_to_end() const noexcept { return seconds_to_end_; }

 private:
  Folder folder_;
  Program program_;
  steady_clock::time_point signalled_at_;
  double seconds_to_end_ = 0.0;
};

/// The ego drove, and the last frames have the safe values: speed 0 and no object.
void expect_safe_values_last(const std::string& out) {
  const auto frames = read_can_log(out + "/can-car.log");
  const auto speeds = values_on_bus(frames, "EgoStatus.Speed");
  ASSERT_GE(speeds.size(), 2U);
  EXPECT_TRUE(std::ranges::any_of(speeds, [](double speed) { return speed > 1.0; })) << "the ego never drove";
  EXPECT_EQ(speeds.back(), 0.0);
  for (const char* valid : {"Object0.Valid", "Object1.Valid", "Object2.Valid", "Object3.Valid"}) {
    const auto values = values_on_bus(frames, valid);
    ASSERT_FALSE(values.empty()) << valid;
    EXPECT_EQ(values.back(), 0.0) << valid;
  }
}

TEST(Ending, RunInRealTimeIsPacedByTheWallClock) {
  const Folder folder;
  const Ended run = run_hil(joined(
      {{"run", crossing(), "--duration", "2 s", "--out", folder / "out"}, few_beams(), relaxed_timing()}));
  EXPECT_EQ(run.code, 1) << "two seconds are too short for 500 answers of the DUT\n"
                         << run.output << run.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["clock"], "realtime");
  EXPECT_EQ(report["exit_code"], 1);
  EXPECT_GE(report["wall_ns"].get<std::int64_t>(), 1'990'000'000) << "paced by the wall clock";
  EXPECT_EQ(report["ticks"].get<std::uint64_t>() + report["skipped_ticks"].get<std::uint64_t>(), 2000U)
      << report["watchdog"];
  EXPECT_EQ(report["realtime"]["scheduler"] == "SCHED_FIFO",
            std::ranges::none_of(report["realtime"]["degraded"],
                                 [](const auto& sentence) {
                                   return sentence.template get<std::string>().find("SCHED_FIFO") !=
                                          std::string::npos;
                                 }))
      << report["realtime"];
}

/// Real time is the subject: the run ends within a limit.
TEST(Ending, InterruptEndsARunInOrder) {
  for (const char* clock : {"realtime", "virtual"}) {
    SCOPED_TRACE(clock);
    LongRun run(clock);
    run.interrupt();
    const Ended ended = run.wait();
    EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;
    RecordProperty("seconds_to_end", std::to_string(run.seconds_to_end()));
    EXPECT_LT(run.seconds_to_end(), 5.0) << "one second on an idle machine";
    const auto report = read_report(run.out());
    EXPECT_EQ(report["verdict"], "interrupted");
    EXPECT_EQ(report["exit_code"], 130);
    for (const auto& process : report["processes"])
      EXPECT_EQ(process["exit"], "exited with code 0") << process;
    expect_safe_values_last(run.out());
    for (const char* file : {"report.html", "junit.xml", "trace.json", "signals.csv", "run.log"})
      EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(run.out()) / file)) << file;
  }
}

/// Real time is the subject: the run ends within a limit.
TEST(Ending, SecondInterruptEndsTheProgramAndItsChildren) {
  LongRun run("realtime");
  const auto dut = run.program().child("hil-aeb-controller");
  const auto plc = run.program().child("hil-crossing-plc");
  ASSERT_TRUE(dut && plc);
  // The stopped DUT ignores SIGTERM, so the run has not ended when the second interrupt arrives.
  ASSERT_EQ(::kill(*dut, SIGSTOP), 0);
  run.interrupt();
  const std::string log = run.out() + "/run.log";
  ASSERT_TRUE(eventually([&] { return read_text(log).find("the run is over") != std::string::npos; }));
  ASSERT_TRUE(run.program().running());
  run.program().signal(SIGINT);
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;
  EXPECT_FALSE(std::filesystem::exists(run.out() + "/report.json"))
      << "the second interrupt does not wait for the report";
  EXPECT_LT(run.seconds_to_end(), 5.0);
  for (const pid_t child : {*dut, *plc})
    EXPECT_TRUE(eventually([&] { return ::kill(child, 0) != 0; })) << command_line(child).front();
}

TEST(Ending, InterruptEndsARunThatWaitsForItsPrograms) {
  const Folder folder;
  Program program(hil(joined(
      {{"run", crossing(), "--out", folder / "out", "--set",
        R"(dut.command=[sh, "-c", "exec sleep 3600", "{can.car}"])", "--set", "dut.start_timeout=3600 s"},
       few_beams()})));
  const auto process = program.child("sleep");
  ASSERT_TRUE(process.has_value());
  EXPECT_TRUE(
      eventually([&] { return read_text(folder / "out/run.log").find("started plc") != std::string::npos; }));
  program.signal(SIGINT);
  const Ended ended = program.wait(std::chrono::seconds(20));
  EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;
  EXPECT_EQ(read_report(folder / "out")["verdict"], "interrupted");
  EXPECT_TRUE(eventually([&] { return ::kill(*process, 0) != 0; }));
}

TEST(Ending, InterruptEndsARunThatConnectsToAUnit) {
  const Folder folder;
  write_text(folder / "map.yaml",
             "registers: [{name: fault, table: holding, address: 0, type: u16, access: read}]\n");
  write_text(folder / "absent.yaml",
             "scenario: absent\nduration: 1 s\nmodbus: [{unit: plc, registers: map.yaml, rate: 10 Hz, "
             "start_timeout: 3600 s, device: '127.0.0.1:" +
                 std::to_string(free_port()) + "'}]\n" +
                 "expectations: [{name: away, eventually: modbus.plc.connected == 0}]\n");
  Program program(hil({"run", folder / "absent.yaml", "--out", folder / "out"}));
  const std::string log = folder / "out/run.log";
  EXPECT_TRUE(eventually([&] {
    return std::filesystem::exists(log) && read_text(log).find("scenario absent") != std::string::npos;
  }));
  program.signal(SIGINT);
  const Ended ended = program.wait(std::chrono::seconds(20));
  EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;
  EXPECT_NE(ended.errors.find("the run was stopped before Modbus unit plc"), std::string::npos)
      << ended.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "interrupted");
  EXPECT_EQ(report["expectations"][0]["result"], "not_checked");
}

TEST(Ending, KilledProgramEndsTheRunInTheSafeState) {
  for (const char* clock : {"realtime", "virtual"}) {
    for (const auto& [program, process] :
         {std::pair<std::string, std::string>("hil-aeb-controller", "dut"), {"hil-crossing-plc", "plc"}}) {
      SCOPED_TRACE(clock + (": " + program));
      LongRun run(clock);
      run.signal_child(program, SIGKILL);
      const Ended ended = run.wait();
      EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
      EXPECT_NE(ended.output.find(process), std::string::npos) << ended.output;
      const auto report = read_report(run.out());
      EXPECT_EQ(report["verdict"], "io_failed");
      EXPECT_EQ(report["exit_code"], 4);
      const auto reason = report["reason"].get<std::string>();
      EXPECT_NE(reason.find(process), std::string::npos) << reason;
      EXPECT_NE(reason.find("signal 9"), std::string::npos) << reason;
      const auto& killed = report["processes"][process == "dut" ? 0 : 1];
      EXPECT_EQ(killed["name"], process);
      EXPECT_GT(killed["ended_early_at_ns"].get<std::int64_t>(), 0);
      expect_safe_values_last(run.out());
    }
  }
}

TEST(Ending, UnitThatIsLostAndReturnsIsReported) {
  LongRun run("realtime", {"--set", "modbus.plc.may_be_lost=true"});
  run.signal_child("hil-crossing-plc", SIGSTOP);
  const std::string log = run.out() + "/run.log";
  EXPECT_TRUE(eventually([&] { return read_text(log).find("Modbus unit plc is lost") != std::string::npos; }))
      << read_text(log);
  run.signal_child("hil-crossing-plc", SIGCONT);
  EXPECT_TRUE(eventually([&] {
    return read_text(log).find("Modbus unit plc works again") != std::string::npos;
  })) << read_text(log);
  run.interrupt();
  EXPECT_EQ(run.wait().code, 130);
  std::vector<std::string> events;
  const auto report = read_report(run.out());
  for (const auto& event : report["events"]) {
    if (const auto text = event["text"].get<std::string>(); text.starts_with("Modbus unit plc"))
      events.push_back(text);
  }
  ASSERT_GE(events.size(), 2U);
  EXPECT_TRUE(std::ranges::any_of(
      events, [](const std::string& sentence) { return sentence.starts_with("Modbus unit plc is lost: "); }));
  EXPECT_EQ(events.back(), "Modbus unit plc works again");
  EXPECT_NE(read_text(log).find("exit code 130: stopped"), std::string::npos) << read_text(log);
}

/// The test sleeps, since the length of the pause in real time is the subject.
TEST(Ending, PausedRunReportsThePause) {
  LongRun run("realtime");
  run.program().signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  run.program().signal(SIGCONT);
  const auto frames = [&] { return std::filesystem::file_size(run.out() + "/can-car.log"); };
  EXPECT_TRUE(eventually([&, before = frames()] { return frames() > before; }))
      << "the run does not continue";
  run.interrupt();
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;
  const auto report = read_report(run.out());
  std::uint64_t longest = 0;
  for (const auto& event : report["watchdog"]) {
    const auto text = event["text"].get<std::string>();
    if (text.find("(host pause)") != std::string::npos)
      longest = std::max<std::uint64_t>(longest, std::stoull(text));
  }
  EXPECT_GE(longest, 450U) << report["watchdog"];
  // The pause is the cause of all long misses.
  for (const auto& task : report["tasks"]) {
    for (const auto& miss : task["misses"]) {
      if (miss["lateness_ns"].get<std::int64_t>() <= 300'000'000) continue;
      EXPECT_EQ(miss["cause"], "host pause") << task["name"] << ": " << miss;
    }
  }
}

/// Real time is the subject: the run ends within a limit.
TEST(Ending, HungProgramUnderTheVirtualClockEndsTheRun) {
  for (const auto& [program, name] :
       {std::pair<std::string, std::string>("hil-aeb-controller", "aeb-controller"),
        {"hil-crossing-plc", "plc"}}) {
    LongRun run("virtual");
    run.signal_child(program, SIGSTOP);
    const Ended ended = run.wait();
    EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
    EXPECT_LT(run.seconds_to_end(), 60.0) << program;
    const auto reason = read_report(run.out())["reason"].get<std::string>();
    EXPECT_NE(reason.find(name), std::string::npos) << reason;
  }
}

TEST(Ending, HungProgramOfABusThatMayBeLostLetsTheRunGoOn) {
  LongRun run("virtual", {"--set", "can.car.may_be_lost=true"});
  run.signal_child("hil-aeb-controller", SIGSTOP);
  EXPECT_TRUE(eventually(
      [&] { return read_text(run.out() + "/run.log").find("CAN bus car is lost") != std::string::npos; }));
  // The loss counts after the time-out of BrakeCommand, 200 ms. The file has 100 rows for a second.
  const auto rows = [&] { return std::ranges::count(read_text(run.out() + "/signals.csv"), '\n'); };
  EXPECT_TRUE(eventually([&, before = rows()] { return rows() > before + 100; }));
  run.interrupt();
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;
  const auto report = read_report(run.out());
  ASSERT_EQ(report["losses"].size(), 1U) << report["losses"];
  EXPECT_EQ(report["losses"][0]["permitted"], true) << report["losses"];
  EXPECT_EQ(report["can"][0]["dropped_releases"], 0) << "nothing is released for a bus that is left out";
}

}  // namespace
}  // namespace hil::scenario_test
