// Another Modbus client, mbpoll, reads and writes registers of the PLC during a run.

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

constexpr const char* holding = "4";
constexpr const char* input = "3";
// Addresses of configs/crossing/crossing_plc.yaml.
constexpr int detector_ego = 0, override_mode = 4, light_ego = 0, light_cross = 1;
constexpr int red = 0, green = 2, mode_all_red = 3, mode_cross_green = 2;

/// mbpoll, for single registers of the PLC that a run has started.
class Mbpoll {
 public:
  /// Takes the port from the command line of the PLC.
  explicit Mbpoll(pid_t plc) {
    const std::vector<std::string> words = command_line(plc);
    const auto listen = std::ranges::find(words, "--listen");
    if (listen == words.end() || listen + 1 == words.end()) return;
    port_ = (listen + 1)->substr((listen + 1)->rfind(':') + 1);
  }

  int read(const char* table, int address) const {
    const Ended ended = mbpoll(table, address, {"-c", "1", "-1", "127.0.0.1"});
    std::smatch found;
    const bool answered = std::regex_search(
        ended.output, found, std::regex("\\[" + std::to_string(address) + "\\]:\\s+(-?[0-9]+)"));
    EXPECT_TRUE(ended.code == 0 && answered)
        << "mbpoll, exit " << ended.code << ": " << ended.output << ended.errors;
    return answered ? std::stoi(found[1]) : -1;
  }
  void write(int address, int value) const {
    const Ended ended = mbpoll(holding, address, {"127.0.0.1", std::to_string(value)});
    EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  }

 private:
  Ended mbpoll(const char* table, int address, const std::vector<std::string>& rest) const {
    return Program(joined({{"mbpoll", "-m", "tcp", "-p", port_, "-a", "1", "-0", "-q", "-t", table, "-r",
                            std::to_string(address)},
                           rest}))
        .wait(std::chrono::seconds(20));
  }
  std::string port_;
};

/// The first row from `from` on in which `holds` is true.
template <typename Holds>
std::size_t first_row(const Signals& signals, std::size_t from, const Holds& holds) {
  std::size_t row = from;
  while (row < signals.rows() && !holds(row))
    ++row;
  return row;
}

TEST(ModbusClient, ReadsTheDetectorAndSetsTheLightsDuringARun) {
  const Folder folder;
  Program run(hil(joined({{"run", crossing(), "--duration", "3600 s", "--out", folder / "out"},
                          few_beams(),
                          relaxed_timing()})));
  const auto plc = run.child("hil-crossing-plc");
  ASSERT_TRUE(plc.has_value());
  const Mbpoll mbpoll(*plc);
  const auto log_size = [&] {
    std::error_code absent;
    const auto size = std::filesystem::file_size(folder / "out/can-car.log", absent);
    return absent ? 0 : size;
  };
  ASSERT_TRUE(eventually([&] { return log_size() > 0; })) << run.wait().errors;
  // The run logs several frames in each cycle of the PLC's 50 ms, so many cycles pass.
  const auto wait_for_cycles = [&] {
    EXPECT_TRUE(eventually([&, before = log_size()] { return log_size() > before + 20'000; }));
  };

  EXPECT_TRUE(eventually([&] { return mbpoll.read(holding, detector_ego) == 1; }))
      << "the ego starts on its loop";
  mbpoll.write(override_mode, mode_all_red);
  EXPECT_TRUE(eventually(
      [&] { return mbpoll.read(input, light_ego) == red && mbpoll.read(input, light_cross) == red; }));
  wait_for_cycles();
  mbpoll.write(override_mode, mode_cross_green);
  EXPECT_TRUE(eventually([&] { return mbpoll.read(input, light_cross) == green; }));
  EXPECT_EQ(mbpoll.read(input, light_ego), red);
  wait_for_cycles();
  run.signal(SIGINT);
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;

  const Signals signals(folder / "out");
  const auto& mode = signals["modbus.plc.override_mode"];
  const auto& ego = signals["modbus.plc.light_ego"];
  const auto& cross = signals["modbus.plc.light_cross"];
  EXPECT_EQ(*std::ranges::max_element(signals["detectors.ego"]), 1.0);
  const std::size_t all_red = first_row(signals, 0, [&](std::size_t row) {
    return mode[row] == mode_all_red && ego[row] == red && cross[row] == red;
  });
  ASSERT_LT(all_red, signals.rows()) << "the run never saw all red";
  const std::size_t cross_green = first_row(signals, all_red, [&](std::size_t row) {
    return mode[row] == mode_cross_green && ego[row] == red && cross[row] == green;
  });
  EXPECT_LT(cross_green, signals.rows()) << "the run never saw the crossing road's green";
}

}  // namespace
}  // namespace hil::scenario_test
