// Runs that can not begin: each mistake at its place, each missing part in a clear sentence, an exit code for
// each kind.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// The run is refused with the exit code, and standard error holds each of these.
void expect_refused(const Ended& ended, int code, const std::vector<std::string>& sayings) {
  EXPECT_EQ(ended.code, code) << ended.output << ended.errors;
  for (const std::string& saying : sayings)
    EXPECT_NE(ended.errors.find(saying), std::string::npos)
        << "'" << saying << "' is not in: " << ended.errors;
}

Ended run_copy(const ScenarioCopy& copy, const std::vector<std::string>& more = {}) {
  return run_hil(joined({{"run", copy.file(), "--out", copy.folder() / "out"}, few_beams(), more}));
}

TEST(BadConfig, AnUnknownKeyWithTheNearestOne) {
  ScenarioCopy copy;
  const std::string place = copy.replace("base_rate: 1 kHz", "base_rat: 1 kHz", "base_rat");
  expect_refused(run_copy(copy), 2, {place + ": ", "'base_rat'", "'base_rate'"});
  EXPECT_FALSE(std::filesystem::exists(copy.folder() / "out")) << "a refused run leaves nothing";
}

TEST(BadConfig, AWrongUnit) {
  ScenarioCopy copy;
  const std::string place = copy.replace("range: 120 m", "range: 120 ms", "120 ms");
  expect_refused(run_copy(copy), 2, {place + ": ", "'120 ms' has the unit 'ms'"});
}

TEST(BadConfig, AnUnknownSignalWithTheNearestOne) {
  ScenarioCopy copy;
  const std::string place =
      copy.replace("light_cross: modbus.plc.light_cross", "light_cross: modbus.plc.light_crss", "modbus");
  expect_refused(run_copy(copy), 2,
                 {place + ": ", "'modbus.plc.light_crss'", "did you mean 'modbus.plc.light_cross'"});
}

TEST(BadConfig, AMissingFile) {
  ScenarioCopy copy;
  const std::string place =
      copy.replace("database: crossing.dbc\n", "database: crosing.dbc\n", "crosing.dbc");
  expect_refused(run_copy(copy), 2, {place + ": ", "there is no such file", copy.folder() / "crosing.dbc"});
}

TEST(BadConfig, AnUnknownLayerWithTheNearestOne) {
  ScenarioCopy copy;
  const std::string place = copy.replace("object_layers: [vehicle]", "object_layers: [vehicel]", "vehicel");
  expect_refused(run_copy(copy), 2, {place + ": ", "no layer 'vehicel'", "did you mean 'vehicle'"});
}

TEST(BadConfig, AnUnknownBodyWithTheNearestOne) {
  ScenarioCopy copy;
  const std::string place = copy.replace("carrier: traffic.ego", "carrier: traffic.egoo", "traffic.egoo");
  expect_refused(run_copy(copy), 2, {place + ": ", "no body 'traffic.egoo'", "did you mean 'traffic.ego'"});
}

TEST(BadConfig, AUnitThatDoesNotMatchTheDbcSignal) {
  ScenarioCopy copy;
  const std::string place = copy.replace("Speed: traffic.ego.speed", "Speed: traffic.ego.x", "traffic.ego.x");
  expect_refused(run_copy(copy), 2,
                 {place + ": ", "'traffic.ego.x' is in m, but 'EgoStatus.Speed' is in m/s"});
}

TEST(BadConfig, OneNameForTwoModules) {
  ScenarioCopy copy;
  copy.replace("module: detectors", "module: collision", "collision");
  expect_refused(run_copy(copy), 2,
                 {copy.file() + ":", "the module 'collision' is given twice; first in line"});
}

TEST(BadConfig, ASeedBelowZero) {
  const Folder folder;
  expect_refused(run_hil({"run", crossing(), "--seed", "-1", "--out", folder / "out"}), 2,
                 {"--set seed:1:6: 'seed': -1 is out of range; it can be at least 0"});
}

TEST(BadConfig, AllMistakesAtOnce) {
  ScenarioCopy copy;
  const std::string first = copy.replace("seed: 1\n", "seeed: 1\n", "seeed");
  const std::string second = copy.replace("scan_rate: 1 Hz", "scan_rate: 1 kg", "1 kg");
  const std::string third = copy.replace(
      "period: 10 ms\n        counter: Counter\n        checksum: Checksum\n        "
      "signals: {Speed",
      "period: ten\n        counter: Counter\n        checksum: Checksum\n        "
      "signals: {Speed",
      "ten");
  expect_refused(run_copy(copy), 2, {first + ": ", second + ": ", third + ": "});
}

TEST(BadConfig, AMistakeInsideTheDbc) {
  ScenarioCopy copy;
  const std::string place =
      copy.replace("SG_ YawRate : 23|16@0-", "SG_ YawRate : 23|16@7-", "7-", "crossing.dbc");
  expect_refused(run_copy(copy), 2, {place + ": "});
}

TEST(BadConfig, AMistakeInsideTheRegisterMap) {
  ScenarioCopy copy;
  const std::string place =
      copy.replace("name: override_mode, table: holding, address: 4, type: u16",
                   "name: override_mode, table: holding, address: 4, type: u17", "u17", "crossing_plc.yaml");
  expect_refused(run_copy(copy), 2, {place + ": ", "'u17'"});
}

TEST(BadConfig, AMissingScenario) {
  const Folder folder;
  expect_refused(run_hil({"run", folder / "nothing.yaml"}), 2,
                 {folder / "nothing.yaml: there is no such file"});
  expect_refused(run_hil({"run", folder.path().string()}), 2, {folder.path().string()});
}

TEST(BadConfig, TenMegabytesOfNoiseAreRefusedAtOnce) {
  const Folder folder;
  std::mt19937 random(5);
  std::string noise;
  noise.resize(10'000'000);
  for (char& byte : noise)
    byte = static_cast<char>(random());
  write_text(folder / "noise.yaml", noise);
  const Ended whole = run_hil({"run", folder / "noise.yaml"});
  expect_refused(whole, 2, {folder / "noise.yaml"});
  EXPECT_LT(whole.took.count(), 10.0);
  EXPECT_LT(whole.errors.size(), 100'000U) << "nobody reads more";
  // What just fits within the size that is read at all, and is text.
  noise.resize(1'000'000);
  for (char& byte : noise)
    byte = "{}[]:,-&*!|>'\"%@ \nab01"[static_cast<unsigned char>(byte) % 23];
  write_text(folder / "noise.yaml", noise);
  const Ended text = run_hil({"run", folder / "noise.yaml"});
  expect_refused(text, 2, {folder / "noise.yaml"});
  EXPECT_LT(text.took.count(), 10.0);
  EXPECT_LT(text.errors.size(), 100'000U);
}

TEST(BadConfig, MeshesThatAreNone) {
  ScenarioCopy copy;
  const std::string place =
      copy.replace("shape: {box: [30 m, 20 m, 9 m]}", "shape: {file: house.obj}", "house.obj");
  expect_refused(run_copy(copy), 2, {place + ": ", "there is no such file", "house.obj"});
  write_text(copy.folder() / "house.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  expect_refused(run_copy(copy), 2, {place + ": ", "house.obj", "triangle"});
  write_text(copy.folder() / "house.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n");
  expect_refused(run_copy(copy), 2, {place + ": ", "house.obj"});
}

TEST(BadConfig, APoseThatIsNoNumber) {
  ScenarioCopy copy;
  const std::string place =
      copy.replace("position: [-35 m, -32 m, 4.5 m]", "position: [nan m, -32 m, 4.5 m]", "nan m");
  expect_refused(run_copy(copy), 2, {place + ": "});
}

TEST(BadConfig, WhatATaskCanNotGiveItsModule) {
  ScenarioCopy copy;
  const std::string place = copy.replace("scan_rate: 1 Hz", "scan_rate: 0.7 Hz", "0.7");
  expect_refused(run_copy(copy), 2, {place + ": ", "not a whole number of the task's periods"});
}

TEST(FailOn, AConditionThatCanNotBeReadIsExitCode2) {
  const Folder folder;
  for (const char* bad : {"misses >", "mises > 0", "", "misses > many", "> 0", "misses > 0 misses"}) {
    const Ended ended = run_hil({"run", crossing(), "--fail-on", bad, "--out", folder / "out"});
    expect_refused(ended, 2, {"--fail-on:1:"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out")) << bad;
  }
  expect_refused(run_hil({"run", crossing(), "--fail-on", "mises > 0", "--out", folder / "out"}), 2,
                 {"--fail-on:1:1: 'mises'", "did you mean 'misses'"});
}

TEST(FailOn, AConditionThatComesTrueIsExitCode3) {
  const Folder folder;
  const std::vector<std::string> short_run =
      joined({{"run", crossing(), "--clock", "virtual", "--set", "expectations=[]", "--duration", "500 ms",
               "--out", folder / "out"},
              few_beams()});
  const Ended broken = run_hil(joined({short_run, {"--fail-on", "misses >= 0"}}));
  EXPECT_EQ(broken.code, 3) << broken.output << broken.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["verdict"], "timing_broken");
  EXPECT_NE(report["reason"].get<std::string>().find("misses >= 0"), std::string::npos) << report["reason"];
  const Ended kept = run_hil(joined({short_run, {"--fail-on", "misses > 0 or hard_misses > 0"}}));
  EXPECT_EQ(kept.code, 0) << "the virtual clock misses nothing\n" << kept.output << kept.errors;
}

/// A TCP port on loopback that somebody listens at.
class TakenPort {
 public:
  TakenPort() : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(fd_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(fd_, 1), 0);
    EXPECT_EQ(getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  ~TakenPort() { close(fd_); }
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;
  const std::string& address() const noexcept { return address_; }

 private:
  int fd_;
  std::string address_;
};

TEST(MissingParts, APortInUseIsSaidByTheServer) {
  const TakenPort port;
  const Folder folder;
  write_text(folder / "registers.yaml",
             "registers:\n  - {name: mode, table: holding, address: 0, type: u16, access: read}\n");
  write_text(folder / "server.yaml",
             "scenario: server\nbase_rate: 1 kHz\nduration: 1 s\nmodbus:\n  - {unit: bench, "
             "role: server, device: \"" +
                 port.address() + "\", registers: registers.yaml, rate: 20 Hz, read: [mode]}\n");
  const Ended ended = run_hil({"run", folder / "server.yaml", "--out", folder / "out"});
  expect_refused(ended, 4, {port.address(), "in use"});
}

TEST(MissingParts, APortInUseIsSaidByThePlc) {
  const TakenPort port;
  const Folder folder;
  const Ended ended = run_hil(joined({{"run", crossing(), "--clock", "virtual", "--set",
                                       "modbus.plc.device=" + port.address(), "--out", folder / "out"},
                                      few_beams()}));
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  EXPECT_NE((ended.output + ended.errors).find("process plc exited with code 4"), std::string::npos)
      << ended.output << ended.errors;
  EXPECT_LT(ended.took.count(), 60.0);
  EXPECT_NE(read_text(folder / "out/plc.out").find("in use"), std::string::npos);
}

TEST(MissingParts, AVcanInterfaceThatIsNotThere) {
  const Folder folder;
  const Ended ended = run_hil(
      joined({{"run", crossing(), "--set", "can.car.device=socketcan:vcan77", "--out", folder / "out"},
              few_beams()}));
  // What is missing depends on the machine: the interface, or CAN in the kernel. Both sentences say the way
  // out.
  expect_refused(ended, 4, {"CAN interface 'vcan77'"});
  EXPECT_TRUE(ended.errors.find("ip link add dev vcan77 type vcan") != std::string::npos ||
              ended.errors.find("modprobe") != std::string::npos)
      << ended.errors;
}

const Environment no_driver{{"VK_DRIVER_FILES", "/nonexistent"}, {"VK_ICD_FILENAMES", "/nonexistent"}};

TEST(MissingParts, NoVulkanDeviceIsExitCode5) {
  const Folder folder;
  const Ended ended = run_hil({"run", crossing(), "--out", folder / "out"}, no_driver);
  expect_refused(ended, 5, {"no Vulkan device", "mesa-vulkan-drivers"});
  EXPECT_EQ(std::count(ended.errors.begin(), ended.errors.end(), '\n'), 1)
      << "one sentence: " << ended.errors;
}

TEST(MissingParts, AVulkanDeviceOfAnotherNameIsExitCode5) {
  const Folder folder;
  expect_refused(run_hil({"run", crossing(), "--set", "world.gpu=voodoo", "--out", folder / "out"}), 5,
                 {"voodoo", "llvmpipe"});
}

TEST(MissingParts, TheDoctorSaysThatThereIsNoVulkanDevice) {
  const Ended ended = run_hil({"doctor"}, no_driver);
  EXPECT_EQ(ended.code, 5);
  EXPECT_NE(ended.output.find("no Vulkan device"), std::string::npos) << ended.output;
  EXPECT_NE(ended.output.find("wake-up latency"), std::string::npos) << "the rest is looked at all the same";
}

TEST(MissingParts, TheDoctorNamesTheDevice) {
  const Ended ended = run_hil({"doctor"});
  EXPECT_EQ(ended.code, 0) << ended.output;
  for (const char* topic : {"Vulkan device", "opens on", "SocketCAN", "SCHED_FIFO", "wake-up latency"})
    EXPECT_NE(ended.output.find(topic), std::string::npos) << topic << " is not in: " << ended.output;
}

TEST(MissingParts, AProgramThatIsNotThere) {
  const Folder folder;
  const Ended ended =
      run_hil(joined({{"run", crossing(), "--set", "dut.command=[no-such-controller, \"{can.car}\"]", "--out",
                       folder / "out"},
                      few_beams()}));
  expect_refused(ended, 4, {"no-such-controller"});
}

TEST(MissingParts, AProgramThatEndsAtOnce) {
  const Folder folder;
  const Ended ended = run_hil(
      joined({{"run", crossing(), "--set", "dut.command=[\"false\", \"{can.car}\"]", "--out", folder / "out"},
              few_beams()}));
  expect_refused(ended, 4, {"dut", "exited with code 1"});
}

TEST(MissingParts, AProgramThatDoesNotConnectInItsOwnTimeIsNamed) {
  for (const char* clock : {"virtual", "realtime"}) {
    const Folder folder;
    Program run(hil(joined({{"run", crossing(), "--clock", clock, "--out", folder / "out", "--set",
                             R"(dut.command=[sh, "-c", "sleep 100", "{can.car}"])", "--set",
                             "dut.start_timeout=400 ms", "--set", "processes.plc.start_timeout=60 s"},
                            few_beams()})));
    const Ended ended = run.wait();
    expect_refused(ended, 4, {"process dut did not connect to bus car within its start_timeout of 400 ms"});
    EXPECT_LT(ended.took.count(), 8.0) << "its own limit holds, not another's";
  }
}

TEST(MissingParts, AScriptMayStartTheProgramThatConnects) {
  for (const char* clock : {"virtual", "realtime"}) {
    const Folder folder;
    const Ended ended = run_hil(joined(
        {{"run", crossing(), "--clock", clock, "--duration", "200 ms", "--out", folder / "out", "--set",
          "dut.command=[sh, -c, \"" + built("hil-aeb-controller") +
              " --bus {can.car} --database crossing.dbc; true\"]"},
         few_beams(),
         patient_watchdog()}));
    EXPECT_EQ(ended.code, 1) << "too few answers in this time: " << ended.output << ended.errors;
  }
}

TEST(MissingParts, AFolderThatCanNotBeWritten) {
  for (const char* folder : {"/proc", "/proc/nothing", "/dev/null", "/dev/null/out"}) {
    const Ended ended = run_hil(joined({{"run", crossing(), "--out", folder}, few_beams()}));
    expect_refused(ended, 4, {folder});
  }
}

}  // namespace
}  // namespace hil::scenario_test
