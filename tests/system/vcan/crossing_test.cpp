// The crossing on a real vcan0: hil and its DUT on AF_CAN sockets, with can-utils on the same bus.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "real_bus.hpp"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

using io::can::LoggedFrame;

constexpr canid_t brake_command = 0x300;

/// In real time on one processor for hil, its DUT, candump and a software GPU: few beams, a long tick, and no
/// real-time priority.
std::vector<std::string> on_vcan0(const std::string& out, const std::vector<std::string>& more) {
  return hil(joined({{"run", crossing(), "--set", "can.car.device=socketcan:vcan0", "--out", out},
                     {"--set", "realtime.scheduler=other", "--set", "base_rate=100 Hz"},
                     {"--set", "tasks.traffic.rate=100 Hz", "--set", "tasks.collision.rate=100 Hz"},
                     {"--set", "tasks.scanner.parameters.columns=96"},
                     {"--set", "tasks.scanner.parameters.rows=24"},
                     {"--set", "tasks.scanner.parameters.compare=[]", "--set", "world.views=[]"},
                     relaxed_timing(),
                     more}));
}

TEST(CrossingOnVcan, LogAgreesWithCandump) {
  const Folder folder;
  io::can::Candump candump;
  Program program(on_vcan0(folder / "out", {}));
  const Ended run = program.wait(std::chrono::seconds(180));
  const std::vector<LoggedFrame> seen = candump.log();
  io::can::real_frames_seen += seen.size();
  std::printf("%s", run.output.c_str());
  // Expectations about time may fail on a slow machine; the frames on the bus do not depend on it.
  EXPECT_TRUE(run.code == 0 || run.code == 1) << run.code << run.output << run.errors;
  const auto report = read_report(folder / "out");
  EXPECT_NE(report["can"][0]["driver"].get<std::string>().find("vcan0"), std::string::npos);

  const std::vector<LoggedFrame> ours = read_can_log(folder / "out/can-car.log");
  EXPECT_GT(ours.size(), 1000U);
  ASSERT_GE(seen.size(), ours.size());
  for (std::size_t i = 0; i < ours.size(); ++i)
    ASSERT_EQ(io::can::cansend_text(ours[i].frame), io::can::cansend_text(seen[i].frame))
        << "frame " << i << " of " << ours.size();
  // The DUT may answer lists after hil has closed its socket, on a slow machine several.
  const std::size_t lists = values_on_bus(ours, "ObjectHeader.Counter").size();
  const std::size_t answers = values_on_bus(ours, "BrakeCommand.AnswerTo").size();
  EXPECT_LE(seen.size() - ours.size(), lists - std::min(answers, lists));
  for (std::size_t i = ours.size(); i < seen.size(); ++i)
    EXPECT_EQ(seen[i].frame.identifier(), brake_command);
  EXPECT_GT(values_on_bus(seen, "BrakeCommand.AnswerTo").size(), 50U) << "the DUT answers on the same bus";
}

TEST(CrossingOnVcan, BrakeCommandsOfCanUtilsReachTheCar) {
  const Folder folder;
  const std::size_t before = io::can::listeners();
  Program program(on_vcan0(folder / "out", {"--set", "dut.enabled=false", "--duration", "3600 s"}));
  // Until its first frame: the car drives.
  ASSERT_TRUE(eventually([&] { return io::can::listeners() > before; }, std::chrono::seconds(150)))
      << program.wait(std::chrono::seconds(1)).errors;
  EXPECT_EQ(io::can::Tool({"candump", "-n", "1", "vcan0"}, folder / "first_frame.log").finish(), 0);

  constexpr double commanded_mps2 = 1.51;  // so small that the car needs seconds to stop
  io::can::BrakeCommands commands;
  const auto cansend = [](const std::string& frame) {
    EXPECT_EQ(io::can::Tool({"cansend", "vcan0", frame}).finish(), 0) << frame;
  };
  // 6 s, so that the brakes build up on a slow machine. One program sends all frames: a start of one for each
  // frame may take longer than the time-out of a command.
  constexpr std::size_t command_count = 150;
  std::string played;
  for (std::size_t i = 0; i < command_count; ++i) {
    char time[32];
    std::snprintf(time, sizeof time, "(%.6f) ", 1.0 + 0.04 * static_cast<double>(i));
    played += time + ("vcan0 " + commands.next(commanded_mps2)) + "\n";
  }
  write_text(folder / "commands.log", played);
  EXPECT_EQ(io::can::Tool({"canplayer", "-I", folder / "commands.log"}).finish(), 0);
  // A frame with a wrong checksum has no effect.
  std::string wrong = commands.next(9.0);
  wrong.back() = wrong.back() == '0' ? '1' : '0';
  cansend(wrong);
  std::this_thread::sleep_for(std::chrono::seconds(1));  // longer than the time-out, in real time
  program.signal(SIGINT);
  const Ended ended = program.wait(std::chrono::seconds(60));
  EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;

  const Signals signals(folder / "out");
  const auto& deceleration = signals["can.car.BrakeCommand.Deceleration"];
  ASSERT_FALSE(deceleration.empty());
  EXPECT_EQ(deceleration.front(), 0.0);
  EXPECT_NEAR(*std::ranges::max_element(deceleration), commanded_mps2, 1e-9);
  EXPECT_EQ(deceleration.back(), 0.0) << "the command has timed out";
  // The driver of the car may brake harder at another time.
  EXPECT_TRUE(std::ranges::any_of(signals["traffic.ego.acceleration"],
                                  [](double a_mps2) { return std::abs(a_mps2 + commanded_mps2) < 0.05; }));
  EXPECT_EQ(read_report(folder / "out")["can"][0]["bad_checksum"], 1);
  const auto frames = read_can_log(folder / "out/can-car.log");
  io::can::real_frames_seen += frames.size();
  EXPECT_EQ(values_on_bus(frames, "BrakeCommand.Deceleration").size(), command_count + 1);
}

/// Without a world, whose database takes long to start in user-mode Linux.
TEST(RunOnVcan, InterfaceThatGoesDownIsALoss) {
  const Folder folder;
  const std::size_t before = io::can::listeners();
  write_text(folder / "s.yaml",
             "scenario: bus\nbase_rate: 100 Hz\nduration: 3600 s\n"
             "can:\n  - bus: car\n    device: socketcan:vcan0\n    database: " +
                 std::filesystem::path(crossing()).replace_extension(".dbc").string() +
                 "\n    rate: 100 Hz\n    send: [{message: EgoStatus, period: 20 ms}]\n");
  Program program(hil(joined({{"run", folder / "s.yaml", "--out", folder / "out"},
                              {"--set", "realtime.scheduler=other"},
                              relaxed_timing()})));
  ASSERT_TRUE(eventually([&] { return io::can::listeners() > before; }, std::chrono::seconds(150)))
      << program.wait(std::chrono::seconds(1)).errors;
  EXPECT_EQ(io::can::Tool({"candump", "-n", "1", "vcan0"}, folder / "first_frame.log").finish(), 0);
  io::can::shell("ip link set vcan0 down");
  std::this_thread::sleep_for(std::chrono::seconds(2));  // the length of the loss, in real time
  io::can::shell("ip link set vcan0 up");
  EXPECT_EQ(io::can::Tool({"candump", "-n", "1", "vcan0"}, folder / "later_frame.log").finish(), 0);
  program.signal(SIGINT);
  const Ended ended = program.wait(std::chrono::seconds(60));
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  ASSERT_EQ(report["losses"].size(), 1U) << report["losses"];
  EXPECT_EQ(report["losses"][0]["what"], "CAN bus car");
  EXPECT_EQ(report["losses"][0]["to_the_end"], false);
  EXPECT_GT(report["losses"][0]["duration_ns"].get<std::int64_t>(), 1'000'000'000);
  EXPECT_NE(report["can"][0]["send_fault"].get<std::string>().find("Network is down"), std::string::npos)
      << report["can"][0];
  const Signals signals(folder / "out");
  EXPECT_EQ(signals["can.car.connected"].front(), 1.0);
  EXPECT_TRUE(std::ranges::count(signals["can.car.connected"], 0.0) > 0);
  io::can::real_frames_seen += read_can_log(folder / "out/can-car.log").size();
}

}  // namespace
}  // namespace hil::scenario_test
