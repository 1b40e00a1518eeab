// mbpoll and pymodbus as peers. These tests fail on a machine without them.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <sstream>

#include "io/modbus/client_device.hpp"
#include "io/modbus/server_device.hpp"
#include "programs.hpp"
#include "registers.hpp"
#include "tests/paths.h"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::modbus {
namespace {

using test::CommandResult;
using test::entry;
using test::latched;
using test::mbpoll;
using test::run_command;

void need_mbpoll() {
  ASSERT_EQ(run_command("command -v mbpoll").exit_code, 0) << "mbpoll is missing: apt-get install mbpoll";
}

void need_pymodbus() {
  ASSERT_EQ(run_command("/usr/bin/python3 -c 'import pymodbus.client, pymodbus.server'").exit_code, 0)
      << "pymodbus is missing: apt-get install python3-pymodbus python3-serial-asyncio";
}

std::string script(const std::string& name) {
  return std::string(HIL_SOURCE_DIR) + "/tests/unit/io_modbus/" + name;
}

/// The values of lines like "[10]: \t42".
std::vector<std::string> values_in(const std::string& output) {
  std::vector<std::string> values;
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t tab = line.find(": \t");
    if (!line.empty() && line[0] == '[' && tab != std::string::npos) values.push_back(line.substr(tab + 3));
  }
  return values;
}

RegisterMap panel_map() {
  RegisterMap map{{entry("a", Table::holding, 0, ValueType::u64, false),
                   entry("b", Table::input, 0, ValueType::f64, true)}};
  for (std::uint16_t i = 0; i < 10; ++i) {
    map.entries.push_back(entry(test::numbered("coil", i), Table::coil, i, ValueType::boolean, false));
  }
  return map;
}

TEST(ExternalTools, MbpollReadsAndWritesTheServer) {
  need_mbpoll();
  RegisterMap map{{entry("speed", Table::input, 4, ValueType::f32, true),
                   entry("count", Table::input, 6, ValueType::i32, true),
                   entry("lamp", Table::discrete_input, 0, ValueType::boolean, true),
                   entry("setpoint", Table::holding, 100, ValueType::i32, false),
                   entry("mode", Table::holding, 102, ValueType::u16, false),
                   entry("start", Table::coil, 2, ValueType::boolean, false)}};
  map.entries[0].order = ByteOrder::abcd;
  map.entries[1].order = ByteOrder::cdab;
  map.entries[3].order = ByteOrder::cdab;  // mbpoll's order without -B
  RunningClock clock;
  ServerDevice device({.name = "panel"}, map);
  device.start(clock, Pacing::realtime);
  device.release_outputs(std::vector<double>{12.5, -70000, 1}, 0);
  EXPECT_EQ(values_in(mbpoll(device.port(), "-t 3:float -B -r 4").output), std::vector<std::string>{"12.5"});
  EXPECT_EQ(values_in(mbpoll(device.port(), "-t 3:int -r 6").output), std::vector<std::string>{"-70000"});
  EXPECT_EQ(values_in(mbpoll(device.port(), "-t 1 -r 0").output), std::vector<std::string>{"1"});
  EXPECT_EQ(mbpoll(device.port(), "-t 4:int -r 100", "-- -123456").exit_code, 0);
  EXPECT_EQ(mbpoll(device.port(), "-t 4 -r 102", "3").exit_code, 0);
  EXPECT_EQ(mbpoll(device.port(), "-t 0 -r 2", "1").exit_code, 0);
  const std::vector<Sample> samples = latched(device);
  EXPECT_EQ(samples[0].value, -123456.0);
  EXPECT_EQ(samples[1].value, 3.0);
  EXPECT_EQ(samples[2].value, 1.0);
  const CommandResult refused = mbpoll(device.port(), "-t 4 -r 103", "3");
  EXPECT_NE(refused.output.find("Illegal data address"), std::string::npos) << refused.output;
}

TEST(ExternalTools, PymodbusUsesEveryFunctionOfTheServer) {
  need_pymodbus();
  RunningClock clock;
  ServerDevice device({.name = "panel"}, panel_map());
  device.start(clock, Pacing::realtime);
  device.release_outputs(std::vector<double>{1234.5}, 0);
  const CommandResult result =
      run_command("/usr/bin/python3 " + script("pymodbus_master.py") + " " + std::to_string(device.port()));
  EXPECT_EQ(result.exit_code, 0) << result.output;
  const double expected = 1.0 * 0x1000000000000 + 2.0 * 0x100000000 + 0x12CD * 65536.0 + 77;
  EXPECT_EQ(latched(device)[0].value, expected);
  EXPECT_EQ(latched(device)[10].value, 1.0);
}

TEST(ExternalTools, ClientReadsAPymodbusUnitWithGaps) {
  need_pymodbus();
  test::Process unit({"/usr/bin/python3", script("pymodbus_unit.py"), "sparse"});
  ASSERT_NE(unit.port(), 0) << unit.first_line();
  const RegisterMap map{{entry("w", Table::holding, 20, ValueType::u16, true),
                         entry("a", Table::holding, 0, ValueType::u16, false),
                         entry("b", Table::holding, 5, ValueType::u16, false)}};
  for (const std::uint16_t max_gap : {std::uint16_t{0}, std::uint16_t{8}}) {
    SetClock clock;
    ClientSettings settings;
    settings.name = "pymodbus";
    settings.endpoint.port = unit.port();
    settings.unit = 250;
    settings.max_gap = max_gap;
    ClientDevice client(settings, map);
    client.start(clock, Pacing::lockstep);
    client.release_outputs(std::vector<double>{7}, 0);
    ASSERT_TRUE(client.exchange(0)) << client.fault();
    EXPECT_EQ(client.fault(), "");
    EXPECT_EQ(latched(client)[0].value, 100.0);
    EXPECT_EQ(latched(client)[1].value, 105.0);
    EXPECT_EQ(client.counters().by_code[2], max_gap == 0 ? 0U : 1U);
    client.stop();
  }
}

TEST(ExternalTools, ClientReadsAndWritesAPymodbusUnit) {
  need_pymodbus();
  test::Process unit({"/usr/bin/python3", script("pymodbus_unit.py")});
  ASSERT_NE(unit.port(), 0) << unit.first_line();
  RegisterMap map{{entry("wide", Table::holding, 10, ValueType::f64, true),
                   entry("one", Table::holding, 20, ValueType::u16, true),
                   entry("coil", Table::coil, 7, ValueType::boolean, true),
                   entry("input", Table::input, 30, ValueType::u32, false),
                   entry("bit1", Table::discrete_input, 1, ValueType::boolean, false),
                   entry("bit2", Table::discrete_input, 2, ValueType::boolean, false),
                   entry("beside", Table::holding, 21, ValueType::u16, false)}};
  SetClock clock;
  ClientSettings settings;
  settings.name = "pymodbus";
  settings.endpoint.port = unit.port();
  ClientDevice client(settings, map);
  client.start(clock, Pacing::lockstep);
  client.release_outputs(std::vector<double>{-0.125, 4242, 0}, 0);
  ASSERT_TRUE(client.exchange(0)) << client.fault();
  std::vector<Sample> samples = latched(client);
  EXPECT_EQ(samples[0].value, 130.0 * 65536 + 131);
  EXPECT_EQ(samples[1].value, 1.0);
  EXPECT_EQ(samples[2].value, 0.0);
  EXPECT_EQ(samples[3].value, 121.0) << "a write touched its neighbour";
  client.stop();

  // A second client reads what the first one wrote.
  for (RegisterEntry& one : map.entries)
    one.writable = false;
  ClientDevice reader(settings, map);
  reader.start(clock, Pacing::lockstep);
  reader.release_outputs({}, 1);
  ASSERT_TRUE(reader.exchange(1)) << reader.fault();
  samples = latched(reader);
  EXPECT_EQ(samples[0].value, -0.125);
  EXPECT_EQ(samples[1].value, 4242.0);
  EXPECT_EQ(samples[2].value, 0.0);
  EXPECT_EQ(reader.counters().errors, 0U);

  unit.kill();
  reader.release_outputs({}, 2);
  EXPECT_FALSE(reader.exchange(2));
  EXPECT_NE(reader.fault().find("pymodbus"), std::string::npos);
}

}  // namespace
}  // namespace hil::io::modbus
