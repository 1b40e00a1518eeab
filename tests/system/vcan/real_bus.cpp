#include "real_bus.hpp"

#include <unistd.h>

#include <cstdio>
#include <fstream>

namespace hil::io::can {

std::size_t listeners() {
  std::ifstream list("/proc/net/can/rcvlist_all");
  std::size_t count = 0;
  for (std::string line; std::getline(list, line);)
    count += line.find(" vcan0 ") != std::string::npos ? 1 : 0;
  return count;
}

std::filesystem::path scratch(const std::string& name) {
  return std::filesystem::path(::testing::TempDir()) / (name + "-" + std::to_string(::getpid()));
}

Witness::Witness(std::vector<std::string> options) : file_(scratch("candump")) {
  const std::size_t before = listeners();
  std::vector<std::string> command{"candump", "-L", "-r", "8000000"};
  command.insert(command.end(), options.begin(), options.end());
  command.push_back("vcan0,0:0,#FFFFFFFF");  // every frame, and every error frame
  candump_ = std::make_unique<Tool>(command, file_);
  EXPECT_TRUE(eventually([&] { return listeners() > before; })) << "candump does not listen";
}

std::vector<LoggedFrame> Witness::log() {
  EXPECT_EQ(candump_->stop(), 0) << "candump";
  CandumpLog log = read_candump_log(file_);
  EXPECT_EQ(log.fault, "");
  EXPECT_TRUE(log.bad_lines.empty()) << "line " << log.bad_lines.front();
  std::filesystem::remove(file_);
  return std::move(log.frames);
}

/// No test of this program means anything on a bus that is not the kernel's.
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
    EXPECT_GT(real_frames_seen.load(), 0U) << "no frame was ever seen on a real AF_CAN socket";
    std::printf("frames seen on real AF_CAN sockets: %llu\n",
                static_cast<unsigned long long>(real_frames_seen.load()));
  }
};

const ::testing::Environment* const real_bus = ::testing::AddGlobalTestEnvironment(new RealBus);

}  // namespace hil::io::can
