// Runs that can not begin: mistakes of the scenario with their places, missing parts of the machine, and
// their exit codes.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/silent_listener.hpp"

namespace hil::scenario_test {
namespace {

/// The run is refused with this exit code, and standard error contains each of the texts.
void expect_refused(const Ended& ended, int code, const std::vector<std::string>& texts) {
  EXPECT_EQ(ended.code, code) << ended.output << ended.errors;
  for (const std::string& text : texts)
    EXPECT_NE(ended.errors.find(text), std::string::npos) << "'" << text << "' is not in: " << ended.errors;
}

Ended run_copy(const ScenarioCopy& copy, const std::vector<std::string>& more = {}) {
  return run_hil(joined({{"run", copy.file(), "--out", copy.folder() / "out"}, few_beams(), more}));
}

struct Change {
  const char *from, *to, *marked;
  std::vector<std::string> texts;  ///< of the mistake, whose place is that of `marked`
  const char* file = "crossing.yaml";
};

/// One mistake of each part that reads a scenario.
TEST(BadScenario, IsRefusedWithThePlaceOfItsMistake) {
  const Change changes[] = {
      {"base_rate: 1 kHz", "base_rat: 1 kHz", "base_rat", {"'base_rat'", "'base_rate'"}},
      {"database: crossing.dbc\n", "database: crosing.dbc\n", "crosing.dbc", {"there is no such file"}},
      {"light_cross: modbus.plc.light_cross",
       "light_cross: modbus.plc.light_crss",
       "modbus",
       {"'modbus.plc.light_crss'", "did you mean 'modbus.plc.light_cross'"}},
      {"object_layers: [vehicle]",
       "object_layers: [vehicel]",
       "vehicel",
       {"no layer 'vehicel'", "did you mean 'vehicle'"}},
      {"carrier: traffic.ego\n",
       "carrier: traffic.egoo\n",
       "traffic.egoo",
       {"no body 'traffic.egoo'", "did you mean 'traffic.ego'"}},
      {"shape: {box: [30 m, 20 m, 9 m]}", "shape: {file: house.obj}", "house.obj", {"there is no such file"}},
      {"scan_rate: 1 Hz", "scan_rate: 0.7 Hz", "0.7", {"not a whole number of the task's periods"}},
      {"SG_ YawRate : 23|16@0-", "SG_ YawRate : 23|16@7-", "7-", {}, "crossing.dbc"},
      {"name: override_mode, table: holding, address: 4, type: u16",
       "name: override_mode, table: holding, address: 4, type: u17",
       "u17",
       {"'u17'"},
       "crossing_plc.yaml"},
  };
  for (const auto& [from, to, marked, texts, file] : changes) {
    SCOPED_TRACE(to);
    ScenarioCopy copy;
    const std::string place = copy.replace(from, to, marked, file);
    expect_refused(run_copy(copy), 2, joined({{place + ": "}, texts}));
    std::string files;
    for (const auto& entry : std::filesystem::directory_iterator(copy.folder() / "out"))
      files += entry.path().filename().string() + " ";
    EXPECT_EQ(files, "junit.xml ");
    const std::string junit = read_text(copy.folder() / "out/junit.xml");
    EXPECT_NE(junit.find("errors=\"1\""), std::string::npos) << junit;
    EXPECT_EQ(junit.find("<error "), junit.rfind("<error ")) << junit;
    EXPECT_NE(junit.find(place), std::string::npos) << junit;
  }
}

/// A mistake hides none in other parts, whether the schema, a condition or the wiring finds it.
TEST(BadScenario, IsRefusedWithAllMistakes) {
  const Change wiring = {"light_cross: modbus.plc.light_cross",
                         "light_cross: modbus.plc.light_crss",
                         "modbus",
                         {"did you mean 'modbus.plc.light_cross'"}};
  const std::vector<Change> combinations[] = {
      {wiring,
       {"never: collision.total > 0",
        "never: collision.total >> 0",
        "> 0",
        {"expected a signal or a number, found '>'"}}},
      {wiring, {"never: collision.total > 0", "nevr: collision.total > 0", "nevr", {"unknown key 'nevr'"}}},
      {{"seed: 1\n", "seeed: 1\n", "seeed", {"'seed'"}},
       {"scan_rate: 1 Hz", "scan_rate: 1 kg", "1 kg", {"has the unit 'kg'"}}}};
  for (const std::vector<Change>& changes : combinations) {
    ScenarioCopy copy;
    std::vector<std::string> texts;
    for (const auto& [from, to, marked, words, file] : changes)
      texts = joined({texts, {copy.replace(from, to, marked) + ": "}, words});
    expect_refused(run_hil({"check", copy.file()}), 2, texts);
  }
}

TEST(BadScenario, PathOfAProgramHasToExistAndANameThatIsNotFoundIsAWarning) {
  const Folder folder;
  std::filesystem::create_directory(folder / "a_folder");
  write_text(folder / "data.txt", "no program");
  write_text(folder / "tool.sh", "#!/bin/sh\nexit 0\n");
  std::filesystem::permissions(folder / "tool.sh", std::filesystem::perms::owner_all);
  const auto check = [&](const std::string& program, const std::string& more = "") {
    write_text(folder / "s.yaml", "scenario: s\nduration: 1 s\nprocesses:\n  tool:\n    command: [\"" +
                                      program + "\"]\n" + more);
    return run_hil({"check", folder / "s.yaml"});
  };
  const std::string place = (folder / "s.yaml") + ":5:15: ";
  for (const auto& [program, problem] :
       {std::pair{"./tol.sh", "does not exist"}, std::pair{"../tool.sh", "does not exist"},
        std::pair{"/nowhere/tool", "does not exist"}, std::pair{"./a_folder", "is a folder"},
        std::pair{"./data.txt", "is not executable"}}) {
    expect_refused(check(program), 2,
                   {place + "the program '" + program + "' of process 'tool' " + std::string(problem)});
    EXPECT_EQ(check(program, "    enabled: false\n").code, 0) << program;
  }
  for (const std::string& program : std::vector<std::string>{"./tool.sh", folder / "tool.sh", "sh", "hil"}) {
    const Ended ended = check(program);
    EXPECT_EQ(ended.code, 0) << program << ended.errors;
    EXPECT_EQ(ended.errors.find("the program"), std::string::npos) << ended.errors;
  }
  const Ended unknown = check("no-such-program-here");
  EXPECT_EQ(unknown.code, 0) << unknown.errors;
  EXPECT_NE(
      unknown.errors.find(place + "warning: the program 'no-such-program-here' of process 'tool' is neither "
                                  "beside hil nor in PATH"),
      std::string::npos)
      << unknown.errors;
}

TEST(BadScenario, MissingFileIsRefused) {
  const Folder folder;
  expect_refused(run_hil({"run", folder / "nothing.yaml"}), 2,
                 {folder / "nothing.yaml: there is no such file"});
  expect_refused(run_hil({"run", folder.path().string()}), 2, {folder.path().string()});
}

TEST(MissingPart, PortInUseIsReportedByTheServer) {
  const SilentListener port;
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

TEST(MissingPart, PortInUseIsReportedByThePlc) {
  const SilentListener port;
  const Folder folder;
  const Ended ended = run_hil(joined({{"run", crossing(), "--clock", "virtual", "--set",
                                       "modbus.plc.device=" + port.address(), "--out", folder / "out"},
                                      few_beams()}));
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  EXPECT_NE((ended.output + ended.errors).find("process plc exited with code 4"), std::string::npos)
      << ended.output << ended.errors;
  // Real time is the subject: the run does not wait for a unit whose program has ended.
  EXPECT_LT(ended.took.count(), 60.0);
  EXPECT_NE(read_text(folder / "out/plc.out").find("in use"), std::string::npos);
}

TEST(MissingPart, CanInterfaceIsReported) {
  const Folder folder;
  const Ended ended = run_hil(
      joined({{"run", crossing(), "--set", "can.car.device=socketcan:vcan77", "--out", folder / "out"},
              few_beams()}));
  // The machine lacks the interface, or CAN in the kernel; both sentences say what to do.
  expect_refused(ended, 4, {"CAN interface 'vcan77'"});
  EXPECT_TRUE(ended.errors.find("ip link add dev vcan77 type vcan") != std::string::npos ||
              ended.errors.find("modprobe") != std::string::npos)
      << ended.errors;
}

const Environment no_driver{{"VK_DRIVER_FILES", "/nonexistent"}, {"VK_ICD_FILENAMES", "/nonexistent"}};

TEST(MissingPart, VulkanDeviceIsExitCode5) {
  const Folder folder;
  const Ended ended = run_hil({"run", crossing(), "--out", folder / "out"}, no_driver);
  expect_refused(ended, 5, {"no Vulkan device", "mesa-vulkan-drivers"});
  EXPECT_EQ(std::count(ended.errors.begin(), ended.errors.end(), '\n'), 1)
      << "one sentence: " << ended.errors;
  EXPECT_EQ(read_report(folder / "out")["verdict"], "gpu_failed");
  EXPECT_EQ(read_report(folder / "out")["exit_code"], 5);
}

TEST(MissingPart, VulkanDeviceOfThisNameIsExitCode5) {
  const Folder folder;
  expect_refused(run_hil({"run", crossing(), "--set", "world.gpu=voodoo", "--out", folder / "out"}), 5,
                 {"voodoo", "llvmpipe"});
}

TEST(MissingPart, VulkanDeviceIsReportedByDoctor) {
  const Ended ended = run_hil({"doctor"}, no_driver);
  EXPECT_EQ(ended.code, 5);
  EXPECT_NE(ended.output.find("no Vulkan device"), std::string::npos) << ended.output;
  EXPECT_NE(ended.output.find("wake-up latency"), std::string::npos) << "the other checks run";
}

TEST(MissingPart, ProgramThatEndsAtItsStartIsReported) {
  const Folder folder;
  const Ended ended = run_hil(
      joined({{"run", crossing(), "--set", "dut.command=[\"false\", \"{can.car}\"]", "--out", folder / "out"},
              few_beams()}));
  expect_refused(ended, 4, {"dut", "exited with code 1"});
}

TEST(MissingPart, ConnectionOfAProgramIsReportedAtItsTimeOut) {
  for (const char* clock : {"virtual", "realtime"}) {
    const Folder folder;
    Program run(hil(joined({{"run", crossing(), "--clock", clock, "--out", folder / "out", "--set",
                             R"(dut.command=[sh, "-c", "sleep 100", "{can.car}"])", "--set",
                             "dut.start_timeout=400 ms", "--set", "processes.plc.start_timeout=60 s"},
                            few_beams()})));
    const Ended ended = run.wait();
    expect_refused(ended, 4, {"process dut did not connect to bus car within its start_timeout of 400 ms"});
    // Real time is the subject.
    EXPECT_LT(ended.took.count(), 8.0) << "the limit of another process does not count";
  }
}

TEST(Processes, ConnectionOfAChildProcessCounts) {
  for (const char* clock : {"virtual", "realtime"}) {
    const Folder folder;
    const Ended ended = run_hil(joined(
        {{"run", crossing(), "--clock", clock, "--duration", "200 ms", "--out", folder / "out", "--set",
          "dut.command=[sh, -c, \"" + built("hil-aeb-controller") +
              " --bus {can.car} --database crossing.dbc; true\"]"},
         few_beams(),
         relaxed_timing()}));
    EXPECT_EQ(ended.code, 1) << "too few answers in this time: " << ended.output << ended.errors;
  }
}

TEST(MissingPart, RunFolderIsReported) {
  for (const char* folder : {"/proc", "/proc/nothing", "/dev/null", "/dev/null/out"}) {
    const Ended ended = run_hil(joined({{"run", crossing(), "--out", folder}, few_beams()}));
    expect_refused(ended, 4, {folder});
  }
}

}  // namespace
}  // namespace hil::scenario_test
