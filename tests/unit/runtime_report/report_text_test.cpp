#include "runtime/report/report_text.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "hostile_text.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/text_safety.hpp"
#include "sample_record.hpp"

namespace hil::report {
namespace {

LiveStatus some_status() {
  return {3'000'000'000, 10'000'000'000, 999.6, 2, 412'345, {{"car", 0.124}, {"body", not_known}}};
}

TEST(LiveLine, HasTimeRateMissesSlackAndBusLoad) {
  EXPECT_EQ(live_line(some_status(), 200),
            "   3.0 s / 10 s   1000 ticks/s  misses 2  slack >= 412 us  car 12 %  body -");
}

TEST(LiveLine, IsNeverWiderThanTheTerminal) {
  for (std::size_t columns = 0; columns < 100; ++columns)
    EXPECT_LE(columns_of(live_line(some_status(), columns)), columns);
  EXPECT_EQ(live_line(some_status(), 0), "");
  EXPECT_EQ(live_line(some_status(), 20), "   3.0 s / 10 s");
}

TEST(LiveLine, AcceptsUnknownValuesAndHostileNames) {
  LiveStatus status;
  status.tick_rate_hz = not_known;
  EXPECT_EQ(live_line(status, 80), "   0.0 s      - ticks/s  misses 0  slack -");
  for (const std::string& text : test::hostile_texts())
    status.buses.push_back({text, 0.5});
  const std::string line = live_line(status, 10'000);
  EXPECT_TRUE(std::ranges::none_of(line, [](char c) { return static_cast<unsigned char>(c) < 0x20U; }));
}

TEST(ReportText, HasVerdictReasonsMissesAndFolder) {
  const std::string text = report_text(test::full_record(), "out/run-1");
  EXPECT_TRUE(text.starts_with("Failed: 1 of 2 expectations did not hold: no collision.\n"));
  EXPECT_NE(text.find("  failed: no collision at 8.412 s: collision.ego was 1; margin -0.25 m at 8.420 s\n"),
            std::string::npos);
  EXPECT_EQ(text.find("DUT answers"), std::string::npos) << "held expectations are not listed";
  EXPECT_NE(
      text.find(
          "  traffic: 2 of 9900 runs missed the deadline (late wake-up 1, own work 1; latest by 402 us)\n"),
      std::string::npos);
  EXPECT_EQ(text.find("detectors"), std::string::npos);
  EXPECT_NE(text.find("  20 of 10000 ticks skipped (0.2 %): they were more than four periods late\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("  the first 4096 events of modules, stimuli and faults are listed, and 1049 more are "
                      "not\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("  degraded: SCHED_FIFO"), std::string::npos);
  EXPECT_TRUE(text.ends_with("  9980 ticks in 10.0 s, report in out/run-1\n"));
}

TEST(ReportText, ReportsWhatABusDidNotSendOrLog) {
  const std::string text = report_text(test::full_record(), "d");
  for (const char* line :
       {"  can.car: 5 output values were beyond the range of the signal: its limit was sent instead\n",
        "  can.car: 7 output values were not a number: the last value was sent again\n",
        "  can.car: 11 sets of outputs were not sent: the thread of the bus was too slow\n",
        "  can.car: 13 frames are missing in the log: the disk was too slow or failed\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  EXPECT_EQ(text.find("fault injection"), std::string::npos) << "the scenario requests it";
  RunRecord sound;
  sound.buses = {test::can_group({{"car", "virtual", 1, 1, 2, 3, 4, 5, 6, 7, 0.5}})};
  EXPECT_EQ(report_text(sound, "d").find("can.car"), std::string::npos);
}

TEST(ReportText, ReportsProblemsOfModbusUnits) {
  const std::string text = report_text(test::full_record(), "d");
  const std::string plc = "  modbus.plc: ";
  for (const std::string& line :
       {plc + "2 requests had no reply in time\n",
        plc + "1 request was refused with exception 2 (illegal data address): reading level (holding 10)\n",
        plc + "2 requests were refused with exception 6 (unit busy), first writing valve (coil 3)\n",
        plc + "the connection was lost and restored once\n",
        plc + "4 output values were beyond the range of the register: its limit was written instead\n",
        plc + "5 input values were beyond the range of the register, and read as it is\n",
        plc + "6 output values were not a number: the register kept its value\n",
        plc + "7 input values were not a finite number: the signal kept its value\n",
        plc + "8 sets of outputs were not sent, because newer outputs came first: the unit or hil's thread "
              "was too slow\n",
        plc + "an input became older than max_age and had its safe value 9 times\n",
        std::string("  modbus.panel: 1 connection was closed because the bytes were not Modbus TCP\n"),
        std::string("  modbus.panel: 10 connections were refused: max_clients was reached, or the system had "
                    "no descriptor\n"),
        std::string("  modbus.panel: 11 idle connections were closed for another client (max_clients)\n"),
        std::string("  modbus.panel: 12 connections were dropped: the client was silent, or did not read its "
                    "replies\n")})
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  EXPECT_EQ(text.find("the reply was invalid"), std::string::npos) << "all three errors are exceptions";
  RunRecord sound;
  buses::modbus::UnitRecord plc_without_faults;
  plc_without_faults.name = "plc";
  sound.buses = {test::modbus_group({plc_without_faults})};
  EXPECT_EQ(report_text(sound, "d").find("modbus.plc"), std::string::npos);
}

TEST(ReportText, HasASentenceForEveryVerdict) {
  for (const Verdict verdict : {Verdict::passed, Verdict::failed, Verdict::timing_broken, Verdict::io_failed,
                                Verdict::gpu_failed, Verdict::interrupted, Verdict::refused}) {
    RunRecord record;
    record.verdict = verdict;
    EXPECT_GT(reason_sentence(record).size(), 10U);
    EXPECT_GT(std::string(headline(verdict)).size(), 5U);
    record.reason = "Because.";
    EXPECT_EQ(reason_sentence(record), "Because.");
  }
}

TEST(ReportText, ReportsWhatARecordingLacks) {
  Recording recording{.file = "recording.mcap", .bytes = 4'096, .messages = 12'345};
  EXPECT_TRUE(lacks_of(recording).empty());
  EXPECT_EQ(to_ascii(recording_text(recording)), "recording.mcap, 4.10 kB, 12345 messages");
  recording.dropped = 1;
  recording.stopped_at_ns = 4'217'000'000;
  recording.not_recorded = 2'000;
  const std::vector<std::string> sentences{
      "recording.mcap lacks 1 message: the disk was too slow",
      "recording.mcap reached its largest size at 4.217 s; 2000 messages were not recorded"};
  EXPECT_EQ(lacks_of(recording), sentences);
  EXPECT_EQ(to_ascii(recording_text(recording)),
            "recording.mcap, 4.10 kB, 12345 messages; " + sentences[0] + "; " + sentences[1]);
}

TEST(ReportText, ReportsMissesWithoutDetails) {
  RunRecord record;
  record.tasks.resize(1);
  record.tasks[0].name = "detectors";
  record.tasks[0].runs = 10;
  record.tasks[0].deadline_misses = 1;
  EXPECT_NE(report_text(record, "d").find("  detectors: 1 of 10 runs missed the deadline\n"),
            std::string::npos);
}

TEST(ReportText, TotalsIncludeMissesThatAreNotListed) {
  RunRecord record;
  record.tasks.resize(1);
  record.tasks[0].name = "slow";
  record.tasks[0].runs = 3'000;
  record.tasks[0].deadline_misses = 2'900;
  record.tasks[0].misses = {{1, "database", 5'000}};
  record.tasks[0].misses_by_cause = {{"own work", 100}, {"database", 2'500}};
  record.tasks[0].worst_lateness_ns = 7'000'000;
  EXPECT_NE(report_text(record, "d")
                .find("2900 of 3000 runs missed the deadline (own work 100, database "
                      "2500, not recorded 300; latest by 7.00 ms)\n"),
            std::string::npos)
      << report_text(record, "d");
}

}  // namespace
}  // namespace hil::report
