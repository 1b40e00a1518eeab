#pragma once
// What the tests of this folder share: proof that the bus is a real one, and can-utils as the other side.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "io/can/candump_log.hpp"
#include "io/can/socketcan_bus.hpp"
#include "io/virtual/process.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::can {

/// Frames that came out of an AF_CAN socket so far; without any, the whole program fails (environment.cpp).
inline std::atomic<std::uint64_t> real_frames_seen{0};

inline void shell(const std::string& command) {
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

inline std::vector<Frame> receive_all(Bus& bus) {
  std::vector<Frame> frames;
  Frame frame;
  while (bus.receive(frame) == ReceiveResult::frame)
    frames.push_back(frame);
  real_frames_seen += frames.size();
  return frames;
}

template <typename Condition>
bool eventually(const Condition& condition, std::chrono::milliseconds limit = std::chrono::seconds(20)) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// Waits until so many frames have come, and takes also what comes at once behind them. The kernel delivers
/// from a soft interrupt, which may run after send() has returned.
inline std::vector<Frame> receive_count(Bus& bus, std::size_t count) {
  std::vector<Frame> frames;
  eventually([&] {
    for (const Frame& frame : receive_all(bus))
      frames.push_back(frame);
    return frames.size() >= count;
  });
  return frames;
}

/// Sockets in this network namespace that receive every frame of a bus, as the kernel lists them.
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

/// candump as the witness: everything on vcan0 from construction to log().
class Witness {
 public:
  explicit Witness(std::vector<std::string> options = {});
  /// Stops it and reads what it wrote.
  std::vector<LoggedFrame> log();

 private:
  std::filesystem::path file_;
  std::unique_ptr<Tool> candump_;
};

/// A file name of this test program in its temporary folder.
std::filesystem::path scratch(const std::string& name);

}  // namespace hil::io::can
