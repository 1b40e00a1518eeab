#include "real_bus.hpp"

#include <cstdio>
#include <fstream>

#include "tests/paths.h"

namespace hil::io::can {

std::size_t listeners() {
  std::ifstream list("/proc/net/can/rcvlist_all");
  std::size_t count = 0;
  for (std::string line; std::getline(list, line);)
    count += line.find(" vcan0 ") != std::string::npos ? 1 : 0;
  return count;
}

Candump::Candump() {
  const std::size_t before = listeners();
  const std::vector<std::string> command{"candump", "-L", "-r", "8000000", "vcan0,0:0,#FFFFFFFF"};
  process_ = std::make_unique<Tool>(command, folder_ / "frames.log");
  EXPECT_TRUE(tests::eventually([&] { return listeners() > before; })) << "candump does not listen";
}

std::vector<LoggedFrame> Candump::log() {
  EXPECT_EQ(process_->stop(), 0) << "candump";
  CandumpLog log = read_candump_log(folder_ / "frames.log");
  EXPECT_EQ(log.fault, "");
  EXPECT_TRUE(log.bad_lines.empty()) << "line " << log.bad_lines.front();
  return std::move(log.frames);
}

std::string cansend_text(const Frame& frame) {
  std::string line;
  append_candump_line(line, frame, "bus");
  return line.substr(line.rfind(' ') + 1);
}

BrakeCommands::BrakeCommands()
    : database_(load_dbc(HIL_SOURCE_DIR "/configs/crossing/crossing.dbc").database),
      message_(*database_.find_message("BrakeCommand")),
      encoder_(message_, {.counter_signal = "Counter", .checksum_signal = "Checksum"}) {}

std::string BrakeCommands::next(double deceleration_mps2, double answer_to) {
  std::vector<double> values;
  for (const DbcSignal& signal : message_.signals)
    values.push_back(signal.name == "Deceleration" ? deceleration_mps2
                     : signal.name == "AnswerTo"   ? answer_to
                                                   : 0.0);
  MessageEncoder::Tally tally;
  const Frame frame = encoder_.build(values, tally);
  encoder_.confirm_sent();
  return cansend_text(frame);
}

/// The tests need a bus of the kernel.
class RealBus final : public ::testing::Environment {
 public:
  void SetUp() override {
    const RunningClock clock;
    SocketCanBus bus({"vcan0"});
    try {
      bus.open(clock, Pacing::realtime);
    } catch (const DeviceError& error) {
      FAIL() << "these tests need a real vcan0; run them under tools/vcan-run: " << error.what();
    }
  }
  void TearDown() override {
    EXPECT_GT(real_frames_seen.load(), 0U) << "no frame was received from a real AF_CAN socket";
    std::printf("frames received from real AF_CAN sockets: %llu\n",
                static_cast<unsigned long long>(real_frames_seen.load()));
  }
};

const ::testing::Environment* const real_bus = ::testing::AddGlobalTestEnvironment(new RealBus);

}  // namespace hil::io::can
