// The crossing on a real vcan0: hil and its DUT on AF_CAN sockets, can-utils as the witness and as a
// stranger.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "io/can/dbc.hpp"
#include "io/can/message_coder.hpp"
#include "real_bus.hpp"
#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

using io::can::LoggedFrame;

constexpr canid_t brake_command = 0x300;

/// In real time where one processor is shared by hil, its DUT, the witness and the GPU's stand-in: few beams,
/// a tick that has room for them, and no thread that would starve the others.
std::vector<std::string> on_vcan0(const std::string& out, const std::vector<std::string>& more) {
  return hil(joined({{"run", crossing(), "--set", "can.car.device=socketcan:vcan0", "--out", out},
                     {"--set", "realtime.scheduler=other", "--set", "base_rate=100 Hz"},
                     {"--set", "tasks.traffic.rate=100 Hz", "--set", "tasks.collision.rate=100 Hz"},
                     {"--set", "tasks.scanner.parameters.columns=96"},
                     {"--set", "tasks.scanner.parameters.rows=24"},
                     {"--set", "tasks.scanner.parameters.compare=[]"},
                     patient_watchdog(),
                     more}));
}

std::string line_of(const LoggedFrame& logged) {
  std::string line;
  io::can::append_candump_line(line, logged.frame, "bus");
  return line.substr(line.rfind(' ') + 1);
}

TEST(CrossingOnVcan, LogAgreesWithCandump) {
  const Folder folder;
  io::can::Witness witness;
  Program program(on_vcan0(folder / "out", {}));
  const Ended run = program.wait(std::chrono::seconds(180));
  const std::vector<LoggedFrame> seen = witness.log();
  io::can::real_frames_seen += seen.size();
  std::printf("%s", run.output.c_str());
  // Whether the DUT keeps its 50 ms, the car its distance and the bus thread every release is up to the
  // machine; what was on the bus is not.
  EXPECT_TRUE(run.code == 0 || run.code == 1) << run.code << run.output << run.errors;
  const auto report = read_report(folder / "out");
  EXPECT_NE(report["can"][0]["driver"].get<std::string>().find("vcan0"), std::string::npos);

  const std::vector<LoggedFrame> ours = read_can_log(folder / "out/can-car.log");
  EXPECT_GT(ours.size(), 1000U);
  ASSERT_GE(seen.size(), ours.size());
  for (std::size_t i = 0; i < ours.size(); ++i)
    ASSERT_EQ(line_of(ours[i]), line_of(seen[i])) << "frame " << i << " of " << ours.size();
  // The DUT may still answer the last list when hil has closed its socket.
  EXPECT_LE(seen.size() - ours.size(), 2U);
  for (std::size_t i = ours.size(); i < seen.size(); ++i)
    EXPECT_EQ(seen[i].frame.identifier(), brake_command);
  EXPECT_GT(values_on_bus(seen, "BrakeCommand.AnswerTo").size(), 50U) << "the DUT answers on the same bus";
}

/// What a stranger has to send for a value to be taken: the counter goes on, the checksum is right.
class BrakeCommands {
 public:
  BrakeCommands()
      : database_(io::can::load_dbc(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.dbc").database),
        message_(*database_.find_message("BrakeCommand")),
        encoder_(message_, {.counter_signal = "Counter", .checksum_signal = "Checksum"}) {}

  /// As an argument of cansend.
  std::string next(double deceleration) {
    std::vector<double> values(message_.signals.size(), 0.0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (message_.signals[i].name == "Deceleration") values[i] = deceleration;
    }
    io::can::MessageEncoder::Tally tally;
    const LoggedFrame logged{"vcan0", encoder_.build(values, tally)};
    encoder_.confirm_sent();
    return line_of(logged);
  }

 private:
  const io::can::Dbc database_;
  const io::can::DbcMessage& message_;
  io::can::MessageEncoder encoder_;
};

TEST(CrossingOnVcan, BrakeCommandsOfCanUtilsReachTheCar) {
  const Folder folder;
  const std::size_t listened = io::can::listeners();
  Program program(on_vcan0(folder / "out", {"--set", "dut.enabled=false", "--duration", "3600 s"}));
  // Its first frame: the car drives, and has not come to its light yet.
  ASSERT_TRUE(eventually([&] { return io::can::listeners() > listened; }, std::chrono::seconds(150)))
      << program.wait(std::chrono::seconds(1)).errors;
  EXPECT_EQ(io::can::Tool({"candump", "-n", "1", "vcan0"}, folder / "first_frame.log").finish(), 0);

  constexpr double asked_mps2 = 1.51;  // gently: it takes seconds to stand
  BrakeCommands commands;
  const auto cansend = [](const std::string& frame) {
    EXPECT_EQ(io::can::Tool({"cansend", "vcan0", frame}).finish(), 0) << frame;
  };
  // 6 s: time to build up for brakes whose ticks come late. From one program: where it takes long to start
  // one for each frame, a command has timed out before the next.
  constexpr std::size_t commanded = 150;
  std::string played;
  for (std::size_t i = 0; i < commanded; ++i) {
    char time[32];
    std::snprintf(time, sizeof time, "(%.6f) ", 1.0 + 0.04 * static_cast<double>(i));
    played += time + ("vcan0 " + commands.next(asked_mps2)) + "\n";
  }
  write_text(folder / "commands.log", played);
  EXPECT_EQ(io::can::Tool({"canplayer", "-I", folder / "commands.log"}).finish(), 0);
  // A frame with a wrong checksum asks for more and must not get it.
  std::string wrong = commands.next(9.0);
  wrong.back() = wrong.back() == '0' ? '1' : '0';
  cansend(wrong);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  program.signal(SIGINT);
  const Ended ended = program.wait(std::chrono::seconds(60));
  EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;

  const Signals signals(folder / "out");
  const auto& asked = signals["can.car.BrakeCommand.Deceleration"];
  ASSERT_FALSE(asked.empty());
  EXPECT_EQ(asked.front(), 0.0);
  EXPECT_NEAR(*std::ranges::max_element(asked), asked_mps2, 1e-9);
  EXPECT_EQ(asked.back(), 0.0) << "the command has timed out";
  // The car's own driver may brake harder at another time.
  EXPECT_TRUE(std::ranges::any_of(signals["traffic.ego.acceleration"],
                                  [](double a_mps2) { return std::abs(a_mps2 + asked_mps2) < 0.05; }));
  EXPECT_EQ(read_report(folder / "out")["can"][0]["bad_checksum"], 1);
  const auto frames = read_can_log(folder / "out/can-car.log");
  io::can::real_frames_seen += frames.size();
  EXPECT_EQ(values_on_bus(frames, "BrakeCommand.Deceleration").size(), commanded + 1);
}

TEST(CrossingOnVcan, InterfaceThatGoesDownIsALoss) {
  const Folder folder;
  const std::size_t listened = io::can::listeners();
  Program program(on_vcan0(folder / "out", {"--set", "dut.enabled=false", "--duration", "3600 s"}));
  ASSERT_TRUE(eventually([&] { return io::can::listeners() > listened; }, std::chrono::seconds(150)))
      << program.wait(std::chrono::seconds(1)).errors;
  EXPECT_EQ(io::can::Tool({"candump", "-n", "1", "vcan0"}, folder / "first_frame.log").finish(), 0);
  io::can::shell("ip link set vcan0 down");
  std::this_thread::sleep_for(std::chrono::seconds(2));  // the loss is reported with its length
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
