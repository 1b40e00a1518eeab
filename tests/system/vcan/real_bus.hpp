#pragma once
// Shared by the tests of this folder: the check that the bus is a real one, and can-utils as the other side.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "io/can/candump_log.hpp"
#include "io/can/message_coder.hpp"
#include "io/can/socketcan_bus.hpp"
#include "io/virtual/process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::io::can {

/// Frames received from AF_CAN sockets; without any, the program fails.
inline std::atomic<std::uint64_t> real_frames_seen{0};

inline void shell(const std::string& command) {
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

inline std::vector<Frame> receive_all(CanTransport& bus) {
  std::vector<Frame> frames;
  Frame frame;
  while (bus.receive(frame) == ReceiveResult::frame)
    frames.push_back(frame);
  real_frames_seen += frames.size();
  return frames;
}

/// Waits for that many frames, and returns also frames that are there behind them. The kernel delivers frames
/// from a soft interrupt, which may run after send() has returned.
inline std::vector<Frame> receive_count(CanTransport& bus, std::size_t count) {
  std::vector<Frame> frames;
  tests::eventually([&] {
    for (const Frame& frame : receive_all(bus))
      frames.push_back(frame);
    return frames.size() >= count;
  });
  return frames;
}

/// The number of sockets in this network namespace that receive every frame of vcan0.
std::size_t listeners();

/// A program of can-utils in a process of its own.
class Tool {
 public:
  explicit Tool(std::vector<std::string> command, const std::filesystem::path& output = {})
      : child_({command.front(), command, {}, {}, output}) {}
  /// Its exit code; a signal counts as 128 and its number.
  int finish() {
    EXPECT_TRUE(child_.wait_for_exit(60'000'000'000)) << child_.name();
    return code_of(child_.stop(1'000'000'000));
  }
  int stop() { return code_of(child_.stop(5'000'000'000)); }

 private:
  static int code_of(const process::Exit& exit) {
    return exit.how == process::Exit::How::exited ? exit.code : 128 + exit.code;
  }
  process::Child child_;
};

/// candump: all frames and error frames on vcan0 from construction to log().
class Candump {
 public:
  Candump();
  /// Stops candump and reads its log.
  std::vector<LoggedFrame> log();

 private:
  const tests::TemporaryFolder folder_;
  std::unique_ptr<Tool> process_;
};

/// A frame as an argument of cansend.
std::string cansend_text(const Frame& frame);

/// Frames of the crossing's BrakeCommand, each with the next counter and a valid checksum.
class BrakeCommands {
 public:
  BrakeCommands();
  /// As an argument of cansend.
  std::string next(double deceleration_mps2, double answer_to = 0.0);

 private:
  const Dbc database_;
  const DbcMessage& message_;
  MessageEncoder encoder_;
};

}  // namespace hil::io::can
