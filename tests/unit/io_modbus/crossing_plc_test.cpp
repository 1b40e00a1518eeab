// The PLC as a process: against the client device, mbpoll, and its register map file.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <sstream>

#include "configs/crossing/plc/plc_registers.hpp"
#include "io/modbus/client_device.hpp"
#include "programs.hpp"
#include "registers.hpp"
#include "tests/paths.h"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::crossing::plc {
namespace {

using namespace io;
using namespace io::modbus;

using std::chrono::milliseconds;
using test::latched;
using test::Process;
using test::run_command;
using tests::eventually;

std::string mbpoll(std::uint16_t port, const std::string& options, const std::string& value = "") {
  return test::mbpoll(port, options, value).output;
}

ClientSettings settings_for(const Process& plc) {
  ClientSettings settings;
  settings.name = "plc";
  settings.endpoint.port = plc.port();
  settings.run_time_ms_entry = "bench_time_ms";
  settings.heartbeat_entry = "heartbeat_hil";
  return settings;
}

double value_of(ClientDevice& client, const std::string& name) {
  const std::vector<Sample> samples = latched(client);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (client.inputs()[i].name == name) return samples[i].value;
  }
  ADD_FAILURE() << "no input " << name;
  return -1.0;
}

/// 20 s of virtual time at 20 Hz with the ego on its detector from 1 s on: every input of every tick, as
/// text.
std::string stepped_run() {
  const Process plc({HIL_CROSSING_PLC, "--listen", "127.0.0.1:0", "--clock", "stepped"});
  SetClock clock;
  ClientDevice client(settings_for(plc), register_map());
  client.start(clock, Pacing::lockstep);
  std::ostringstream text;
  for (int tick = 0; tick < 400; ++tick) {
    const RunTimeNs tick_ns = tick * 50'000'000LL;
    clock.set(tick_ns);
    client.release_outputs(std::vector<double>{tick >= 20 ? 1.0 : 0.0, 0, 0}, tick_ns);
    EXPECT_TRUE(client.exchange(tick_ns)) << client.fault();
    text << tick << ':';
    for (const Sample& sample : latched(client))
      text << ' ' << sample.value << '@' << sample.time_ns << sample.fresh;
    text << '\n';
    // The program has made whole scans up to the time that was written in the same exchange.
    EXPECT_EQ(value_of(client, "plc_time_ms"), tick * 50 / 20 * 20) << tick;
    EXPECT_EQ(value_of(client, "scan_count"), tick * 50 / 20) << tick;
  }
  EXPECT_EQ(value_of(client, "light_ego"), 2.0);
  EXPECT_EQ(value_of(client, "light_cross"), 0.0);
  EXPECT_EQ(value_of(client, "fault"), 0.0);
  return text.str();
}

TEST(CrossingPlc, SteppedRunsAreIdentical) {
  const std::string first = stepped_run();
  EXPECT_EQ(first, stepped_run());
  EXPECT_GT(first.size(), 10'000U);
}

TEST(CrossingPlc, ListensOnAnIpv6Address) {
  const Process plc(
      {HIL_CROSSING_PLC, "--listen", Endpoint{.host = "::1", .port = 0}.to_text(), "--clock", "stepped"});
  EXPECT_TRUE(plc.first_line().starts_with("listening [::1]:")) << plc.first_line();
  ClientSettings settings = settings_for(plc);
  settings.endpoint.host = "::1";
  SetClock clock;
  ClientDevice client(settings, register_map());
  client.start(clock, Pacing::lockstep);
  EXPECT_TRUE(client.exchange(0)) << client.fault();
}

TEST(CrossingPlc, SteppedTimeFollowsTheWrittenTimeAndNeverGoesBack) {
  const Process plc({HIL_CROSSING_PLC, "--clock", "stepped"});
  std::this_thread::sleep_for(milliseconds(60));  // real time is the subject: three scans, not counted
  EXPECT_NE(mbpoll(plc.port(), "-t 3 -r 4").find("[4]: \t0\n"), std::string::npos);
  mbpoll(plc.port(), "-t 4:int -r 10", "1000");
  EXPECT_NE(mbpoll(plc.port(), "-t 3 -r 4").find("[4]: \t50\n"), std::string::npos);
  mbpoll(plc.port(), "-t 4:int -r 10", "500");
  EXPECT_NE(mbpoll(plc.port(), "-t 3 -r 4").find("[4]: \t50\n"), std::string::npos);
  EXPECT_NE(mbpoll(plc.port(), "-t 3:int -r 6").find("[6]: \t1000\n"), std::string::npos);
}

TEST(CrossingPlc, MbpollReadsADetectorAndSetsTheLightDuringARun) {
  ASSERT_EQ(run_command("command -v mbpoll").exit_code, 0) << "mbpoll is missing: apt-get install mbpoll";
  Process plc({HIL_CROSSING_PLC, "--listen", "127.0.0.1:0", "--clock", "wall", "--minimum-green-ms", "100",
               "--yellow-ms", "100", "--all-red-ms", "100", "--red-yellow-ms", "100"});
  ASSERT_EQ(plc.first_line(), "listening 127.0.0.1:" + std::to_string(plc.port()));
  RunningClock clock;
  ClientDevice client(settings_for(plc), register_map());
  client.start(clock, Pacing::realtime);
  const auto runs_until = [&](const std::function<bool()>& holds) {
    return eventually([&] {
      client.release_outputs(std::vector<double>{0, 3, 0}, clock.now_ns());
      return holds();
    });
  };
  EXPECT_TRUE(runs_until([&] { return value_of(client, "light_cross") == 2.0; }));
  EXPECT_NE(mbpoll(plc.port(), "-t 4 -r 1").find("[1]: \t3\n"), std::string::npos);
  EXPECT_NE(mbpoll(plc.port(), "-t 4 -r 4", "1").find("Written 1 references"), std::string::npos);
  EXPECT_TRUE(runs_until([&] { return value_of(client, "light_ego") == 2.0; }))
      << "the override did not reach the light";
  EXPECT_EQ(value_of(client, "override_mode"), 1.0);
  EXPECT_NE(mbpoll(plc.port(), "-t 3 -r 0").find("[0]: \t2\n"), std::string::npos);
  const double scans = value_of(client, "scan_count");
  EXPECT_TRUE(runs_until([&] { return value_of(client, "scan_count") > scans + 5; }));

  // Without a client, the watchdog turns all lights red and sets the fault.
  client.stop();
  EXPECT_TRUE(eventually([&] {
    const std::string lights = mbpoll(plc.port(), "-t 3 -r 0 -c 3");
    return lights.find("[0]: \t0\n[1]: \t0\n[2]: \t1\n") != std::string::npos;
  }));
  EXPECT_EQ(plc.terminate(), 0);
}

TEST(CrossingPlc, WallTimeAdvancesInWholeScans) {
  const Process plc({HIL_CROSSING_PLC});
  const auto number = [&](const std::string& options, const std::string& label) {
    const std::string text = mbpoll(plc.port(), options);
    return std::stoi(text.substr(text.find(label) + label.size()));
  };
  const auto start = std::chrono::steady_clock::now();
  const int first_ms = number("-t 3:int -r 6", "[6]: \t");
  const int first_scan = number("-t 3 -r 4", "[4]: \t");
  int last_scan = first_scan;
  int last_ms = first_ms;
  ASSERT_TRUE(eventually([&] {
    last_scan = number("-t 3 -r 4", "[4]: \t");
    last_ms = number("-t 3:int -r 6", "[6]: \t");
    return last_ms - first_ms >= 500;
  }));
  const auto passed = std::chrono::steady_clock::now() - start;
  EXPECT_LE(last_ms - first_ms, std::chrono::duration_cast<milliseconds>(passed).count() + 20);
  EXPECT_EQ((last_ms - first_ms) % 20, 0);
  EXPECT_LE(last_scan - first_scan, (last_ms - first_ms) / 20);
  EXPECT_GT(last_scan, first_scan);
}

TEST(CrossingPlc, RefusesInvalidOptions) {
  for (const char* const options :
       {"--listen 127.0.0.1", "--listen 127.0.0.1:66000", "--listen :5", "--listen 1.2.3.4:x",
        "--clock sundial", "--yellow-ms -1", "--minimum-green-ms 500 --maximum-green-ms 400"}) {
    const test::CommandResult result = run_command(std::string(HIL_CROSSING_PLC) + " " + options);
    EXPECT_NE(result.exit_code, 0) << options;
    EXPECT_FALSE(result.output.empty()) << options;
  }
  const Process first({HIL_CROSSING_PLC});
  const test::CommandResult second =
      run_command(std::string(HIL_CROSSING_PLC) + " --listen 127.0.0.1:" + std::to_string(first.port()));
  EXPECT_EQ(second.exit_code, 4);
  EXPECT_NE(second.output.find("Address already in use"), std::string::npos) << second.output;
}

TEST(CrossingPlc, RegisterMapFileAgreesWithTheProgram) {
  const YAML::Node registers =
      YAML::LoadFile(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing_plc.yaml")["registers"];
  const RegisterMap map = register_map();
  EXPECT_TRUE(mistakes_in(map, Role::client).empty());
  ASSERT_EQ(registers.size(), map.entries.size());
  for (std::size_t i = 0; i < map.entries.size(); ++i) {
    const RegisterEntry& entry = map.entries[i];
    const YAML::Node& node = registers[i];
    EXPECT_EQ(node["name"].as<std::string>(), entry.name);
    EXPECT_EQ(node["table"].as<std::string>(), to_text(entry.table)) << entry.name;
    EXPECT_EQ(node["address"].as<int>(), entry.address) << entry.name;
    EXPECT_EQ(node["type"].as<std::string>(), to_text(entry.type)) << entry.name;
    EXPECT_EQ(node["word_order"].as<std::string>("ABCD"), to_text(entry.order)) << entry.name;
    EXPECT_EQ(node["scale"].as<double>(1.0), entry.scale) << entry.name;
    EXPECT_EQ(node["unit"].as<std::string>(""), entry.unit) << entry.name;
    EXPECT_EQ(node["access"].as<std::string>(), entry.writable ? "write" : "read") << entry.name;
    EXPECT_FALSE(node["about"].as<std::string>().empty()) << entry.name;
  }
}

TEST(ModbusEndpoint, IsAHostAndAPort) {
  const auto endpoint = parse_endpoint("127.0.0.1:1502");
  ASSERT_TRUE(endpoint);
  EXPECT_EQ(endpoint->host, "127.0.0.1");
  EXPECT_EQ(endpoint->port, 1502);
  EXPECT_EQ(parse_endpoint("[::1]:0")->host, "::1");
  for (const char* const text : {"", "host", "host:", "host:65536", "host:-1", "host:80x", "::1:80"})
    EXPECT_FALSE(parse_endpoint(text)) << text;
}

}  // namespace
}  // namespace hil::crossing::plc
