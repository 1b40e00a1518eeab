// Runs whose devices send nothing, stop sending, or send wrong frames do not pass, unless the scenario is the
// reason.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "io/can/checksum.hpp"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

constexpr const char* database =
    "VERSION \"\"\nBU_: A B\n"
    "BO_ 512 Speed: 8 A\n SG_ V : 0|16@1+ (1,0) [0|65535] \"\" B\n"
    " SG_ Alive : 48|4@1+ (1,0) [0|15] \"\" B\n SG_ CRC : 56|8@1+ (1,0) [0|255] \"\" B\n"
    "BO_ 513 Other: 1 A\n SG_ W : 0|8@1+ (1,0) [0|255] \"\" B\n";

/// In real time runs are slower than under the virtual clock, since other programs delay them.
int slowness(const std::string& clock) {
  return clock == "virtual" ? 1 : 4;
}

/// A duration of the virtual clock, as one of this clock.
std::string scaled(const std::string& clock, int milliseconds) {
  return std::to_string(slowness(clock) * milliseconds) + " ms";
}

/// A station that sends Speed every 10 ms in intervals of the run time, given as FROM-UNTIL in ms, and Other
/// always. Its fourth argument skips that many counter values at 300 ms; by the fifth one all is slower.
constexpr const char* station = R"(import sys, socket, struct, select, time
TIME, FRAME = struct.Struct("=IIQqQ"), struct.Struct("=IB3x8s")
bus, clock, intervals = sys.argv[1:4]
skips, slowness = int(sys.argv[4]), int(sys.argv[5])
intervals = [tuple(map(int, one.split("-"))) for one in intervals.split(",")]
hub = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
hub.connect(bus[5:])
hub.send(struct.pack("=II56s", 0x484C4948, 1, b"station"))
sent, counter = 0, 0
def advance(now_ms):
    global sent, counter
    now_ms /= slowness
    while sent * 10 <= now_ms:
        if any(a <= sent * 10 < b for a, b in intervals):
            if sent == 30: counter += skips
            hub.send(FRAME.pack(0x200, 8, bytes([sent % 256, 0, 0, 0, 0, 0, counter % 16, 0])))
            counter += 1
        hub.send(FRAME.pack(0x201, 1, bytes([1]).ljust(8, b"\0")))
        sent += 1
try:
    start = time.monotonic()
    while True:
        if clock == "wall" and not select.select([hub], [], [], 0.002)[0]:
            advance((time.monotonic() - start) * 1000)
            continue
        packet = hub.recv(128)
        if packet == b"": break
        if len(packet) != TIME.size: continue
        magic, kind, number, now, _ = TIME.unpack(packet)
        if kind == 2:
            advance(now / 1e6)
            hub.send(TIME.pack(magic, 3, number, now, 0))
except (ConnectionResetError, BrokenPipeError): pass
)";

std::string scenario_of(const std::string& clock, const std::string& rest) {
  const std::string rate = clock == "virtual" ? "500 Hz" : "100 Hz";
  return "scenario: devices\nbase_rate: " + rate + "\nduration: " + scaled(clock, 1000) +
         "\nclock: " + clock +
         "\nrealtime: {scheduler: other, lock_memory: false, watchdog: 60 s, max_lost: 100 %}\n" + rest;
}

/// A bus with the station. A module reads the speed, so it reads the safe value of a silent station.
struct StationFolder : ScenarioFolder {
  StationFolder(const std::string& clock, const std::string& intervals, const std::string& more = {},
                const std::string& skips = "0")
      : ScenarioFolder(scenario_of(clock, "can:\n  - bus: car\n    database: bus.dbc\n    rate: 100 Hz\n")) {
    const std::string timeout = clock == "virtual" ? "30 ms" : "300 ms";
    const std::string command = "[python3, station.py, \"{can.car}\", \"{clock}\", \"" + intervals + "\", '" +
                                skips + "', '" + std::to_string(slowness(clock)) + "']";
    write_text(folder / "s.yaml",
               read_text(folder / "s.yaml") + "    receive:\n      - {message: Speed, timeout: " + timeout +
                   ", counter: Alive}\n      - {message: Other, timeout: 1 s}\n"
                   "tasks:\n  - module: plant\n    type: block\n    rate: 100 Hz\n"
                   "    inputs: {v: can.car.Speed.V}\n"
                   "    parameters: {inputs: {v: '1'}, outputs: {y: 2 * v}}\n"
                   "processes:\n  ecu: {command: " +
                   command + "}\nexpectations: [{name: works, always: plant.y >= 0, coverage: 1 %}]\n" +
                   more);
    write_text(folder / "bus.dbc", database);
    write_text(folder / "station.py", station);
  }
};

/// A fault, in times of the virtual clock; without an end if it lasts 0 ms.
std::string fault_of(const std::string& clock, const std::string& effect, int at_ms, int lasts_ms = 0) {
  const std::string end = lasts_ms == 0 ? "" : ", for: " + scaled(clock, lasts_ms);
  return "faults: [{name: f, " + effect + ", at: " + scaled(clock, at_ms) + end + "}]\n";
}

/// Calls `check` for all cases at the same time, since runs in real time mostly wait.
template <class Cases, class Check>
void at_once(const Cases& cases, const Check& check) {
  std::vector<std::jthread> threads;
  for (const auto& one : cases)
    threads.emplace_back([&] { check(one); });
}

class DeadDevices : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Clocks, DeadDevices, ::testing::Values("virtual", "realtime"));

std::string reason_of(const Ended& ended, const std::string& out) {
  EXPECT_TRUE(std::filesystem::exists(out + "/report.json")) << ended.output << ended.errors;
  return read_report(out)["reason"];
}

TEST_P(DeadDevices, MessageThatNeverCameIsNamedUnlessItIsOptional) {
  const StationFolder files(GetParam(), "5000-6000");
  const Ended dead = files.run("out");
  EXPECT_EQ(dead.code, 1) << dead.output << dead.errors;
  EXPECT_EQ(reason_of(dead, files.folder / "out"),
            "no value of message can.car.Speed came; 'optional: true' permits that");
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(report["input_failures"].size(), 1U);
  EXPECT_EQ(report["expectations"][0]["result"], "held") << "the module hides it";
  const auto& inputs = report["can"][0]["inputs"];
  ASSERT_EQ(inputs.size(), 2U);
  EXPECT_EQ(inputs[0]["input"], "Speed");
  EXPECT_EQ(inputs[0]["ticks"], inputs[0]["not_fresh"]);
  EXPECT_EQ(inputs[1]["not_fresh"], 0);
  const std::string junit = read_text(files.folder / "out/junit.xml");
  EXPECT_NE(junit.find("name=\"inputs came and were accepted\""), std::string::npos) << junit;
  EXPECT_NE(junit.find("failures=\"1\""), std::string::npos) << junit;
  EXPECT_NE(read_text(files.folder / "out/report.html").find("no value of message can.car.Speed came"),
            std::string::npos);
  const Ended optional = files.run("optional", {"--set", "can.car.receive.Speed.optional=true"});
  EXPECT_EQ(optional.code, 0) << optional.output << optional.errors;
}

TEST_P(DeadDevices, StationThatDiesFails) {
  at_once(std::array{"0-500", "0-300,600-5000", "100-200", "400-420,900-5000"}, [](const char* intervals) {
    const StationFolder files(GetParam(), intervals);
    const Ended ended = files.run("out");
    EXPECT_EQ(ended.code, 1) << intervals << "\n" << ended.output << ended.errors;
    EXPECT_NE(reason_of(ended, files.folder / "out").find("message can.car.Speed was not fresh on "),
              std::string::npos)
        << ended.output;
  });
}

TEST_P(DeadDevices, StationThatComesLateOrRecoversPasses) {
  at_once(std::array{"0-5000", "700-5000", "0-500,550-5000"}, [](const char* intervals) {
    const StationFolder files(GetParam(), intervals);
    const Ended ended = files.run("out");
    EXPECT_EQ(ended.code, 0) << intervals << "\n" << ended.output << ended.errors;
  });
}

TEST_P(DeadDevices, FaultsThatSilenceTheStationExcuseIt) {
  const std::array faults{"message: can.car.Speed, drop: 100 %",
                          "message: can.car.0x200, drop: 100 %",
                          "message: can.car.Speed, delay: 200 ms",
                          "message: can.car.Speed, length: 0",
                          "message: can.car.Speed, wrong: counter",
                          "device: can.car, state: bus_off",
                          "process: ecu, state: paused"};
  at_once(faults, [](const char* fault) {
    const StationFolder files(GetParam(), "0-5000", fault_of(GetParam(), fault, 300, 300));
    const Ended ended = files.run("out");
    EXPECT_EQ(ended.code, 0) << fault << "\n" << ended.output << ended.errors;
    const auto report = read_report(files.folder / "out");
    const auto& inputs = report["can"][0]["inputs"];
    EXPECT_LT(inputs[0]["ticks"].get<int>() + 10, report["ticks"].get<int>()) << fault << inputs;
  });
}

TEST_P(DeadDevices, FaultsOfSomethingElseDoNotExcuseIt) {
  const std::array faults{"message: can.car.Other, drop: 100 %", "message: can.car.Speed, repeat: 1",
                          "message: can.car.Speed, stuck: last"};
  at_once(faults, [](const char* fault) {
    const StationFolder files(GetParam(), "0-400,700-5000", fault_of(GetParam(), fault, 300, 500));
    const Ended ended = files.run("out");
    EXPECT_EQ(ended.code, 1) << fault << "\n" << ended.output << ended.errors;
  });
}

TEST_P(DeadDevices, StationThatDiesInAFaultOfItsMessageFails) {
  at_once(std::array{"drop: 100 %", "drop: 5 %", "wrong: counter", "delay: 20 ms"}, [](const char* fault) {
    const StationFolder files(GetParam(), "0-500",
                              fault_of(GetParam(), "message: can.car.Speed, " + std::string(fault), 300));
    const Ended ended = files.run("out", {"--seed", "2"});
    EXPECT_EQ(ended.code, 1) << fault << "\n" << ended.output << ended.errors;
    EXPECT_NE(reason_of(ended, files.folder / "out").find("message can.car.Speed was not fresh on"),
              std::string::npos)
        << fault << "\n"
        << ended.output;
  });
}

TEST(DeadDevicesUnderTheVirtualClock, FaultThatTakesAllFramesExcusesAStationThatSendsThem) {
  for (const auto& [intervals, code] :
       {std::pair{"0-5000", 0}, {"200-5000", 0}, {"0-500", 1}, {"5000-6000", 1}}) {
    const StationFolder files("virtual", intervals,
                              fault_of("virtual", "message: can.car.Speed, drop: 100 %", 0));
    const Ended ended = files.run("out");
    EXPECT_EQ(ended.code, code) << intervals << "\n" << ended.output << ended.errors;
  }
}

TEST_P(DeadDevices, StationThatDoesNotComeBackAfterAFaultFails) {
  const StationFolder files(GetParam(), "0-450",
                            fault_of(GetParam(), "device: can.car, state: bus_off", 300, 200));
  const Ended ended = files.run("out");
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
}

/// The value is fresh when the first fault begins, or stale; the faults are shorter than a frame's period.
TEST(DeadDevicesUnderTheVirtualClock, ShortFaultsOfTheBusDoNotExcuseADeadStation) {
  for (const char* const effect : {"device: can.car, state: bus_off", "process: ecu, state: paused"}) {
    for (const auto& [intervals, code] : {std::pair{"0-5000", 0}, {"0-10", 1}, {"0-300", 1}}) {
      for (const auto& [at, every] : {std::pair{"14 ms", "26 ms"}, {"60 ms", "26 ms"}, {"14 ms", "38 ms"}}) {
        const StationFolder files("virtual", intervals,
                                  "faults: [{name: f, " + std::string(effect) + ", at: " + at +
                                      ", for: 2 ms, every: " + every + "}]\n");
        const Ended ended = files.run("out");
        EXPECT_EQ(ended.code, code) << effect << " " << intervals << " " << every << "\n"
                                    << ended.output << ended.errors;
      }
    }
  }
}

TEST_P(DeadDevices, KilledProcessNeedSendNothingAnyMore) {
  const StationFolder files(GetParam(), "0-5000", fault_of(GetParam(), "process: ecu, state: killed", 300));
  const Ended ended = files.run("out");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
}

TEST(DeadDevicesInRealTime, ProcessThatMayBeLostNeedSendNothingAfterItsEnd) {
  const StationFolder files("realtime", "0-5000");
  write_text(files.folder / "ends.sh", "timeout 1 python3 station.py $1 wall 0-5000 0 4; exit 0\n");
  const std::vector<std::string> ends{"--set", "processes.ecu.command=[sh, ends.sh, \"{can.car}\"]"};
  const Ended lost = files.run("lost", joined({ends, {"--set", "processes.ecu.may_be_lost=true"}}));
  EXPECT_EQ(lost.code, 0) << lost.output << lost.errors;
  const Ended unexpected = files.run("unexpected", ends);
  EXPECT_EQ(unexpected.code, 4) << unexpected.output << unexpected.errors;
}

// ---- Modbus

/// A unit and a client, without a library. `unit.py LISTEN DEAD FROM`: answers reads of registers with their
/// addresses, but register DEAD with exception 2, from FROM seconds after the first request on. `client.py
/// ADDRESS LIST`: writes the listed registers every 20 ms.
constexpr const char* unit_program = R"(import sys, socket, struct, time
host, port = sys.argv[1].rsplit(":", 1)
dead, begin = int(sys.argv[2]), float(sys.argv[3])
server = socket.create_server((host, int(port)))
start = None
def take(link, count):
    data = b""
    while len(data) < count:
        part = link.recv(count - len(data))
        if not part: raise OSError
        data += part
    return data
def answer(link):
    global start
    number, _, length, unit = struct.unpack(">HHHB", take(link, 7))
    function, address, count = struct.unpack(">BHH", take(link, length - 1)[:5])
    if start is None: start = time.monotonic()
    if address <= dead < address + count and time.monotonic() - start >= begin:
        reply = bytes([function | 0x80, 2])
    else:
        reply = bytes([function, 2 * count]) + b"".join(struct.pack(">H", address + i) for i in range(count))
    link.sendall(struct.pack(">HHHB", number, 0, len(reply) + 1, unit) + reply)
while True:
    link = server.accept()[0]
    try:
        while True: answer(link)
    except OSError: link.close()
)";
constexpr const char* client_program = R"(import sys, socket, struct, time
host, port = sys.argv[1].rsplit(":", 1)
registers = [int(one) for one in sys.argv[2].split(",")]
for _ in range(200):
    try:
        link = socket.create_connection((host, int(port)))
        break
    except OSError: time.sleep(0.02)
number = 0
try:
    while True:
        for register in registers:
            number += 1
            link.sendall(struct.pack(">HHHBBHH", number % 65536, 0, 6, 1, 6, register, 7))
            link.recv(260)
        time.sleep(0.02)
except OSError: pass
)";

struct UnitFolder : ScenarioFolder {
  UnitFolder(const std::string& clock, const std::string& unit, const std::string& program)
      : ScenarioFolder(scenario_of(
            clock, "modbus: [{unit: plc, device: \"127.0.0.1:auto\", registers: map.yaml, rate: 50 Hz, " +
                       unit + "}]\nprocesses:\n  plc: {free_running: true, command: [" + program + "]}\n")) {
    write_text(folder / "unit.py", unit_program);
    write_text(folder / "client.py", client_program);
    // With a register between them, so that they are read by requests of their own.
    write_text(folder / "map.yaml",
               "registers:\n"
               "  - {name: speed, table: holding, address: 0, type: u16, access: read}\n"
               "  - {name: level, table: holding, address: 2, type: u16, access: read}\n");
  }
};

TEST_P(DeadDevices, RegisterThatTheUnitDoesNotHaveIsNamed) {
  const UnitFolder files(GetParam(), "max_age: 400 ms", "python3, unit.py, \"{modbus.plc}\", '2', '0'");
  const Ended dead = files.run("out");
  EXPECT_EQ(dead.code, 1) << dead.output << dead.errors;
  EXPECT_EQ(reason_of(dead, files.folder / "out"),
            "no value of register modbus.plc.level came; 'optional: true' permits that");
  const Ended optional = files.run("optional", {"--set", "modbus.plc.optional=true"});
  EXPECT_EQ(optional.code, 0) << optional.output << optional.errors;
  const Ended unread = files.run("unread", {"--set", "modbus.plc.read=[speed]"});
  EXPECT_EQ(unread.code, 0) << unread.output << unread.errors;
  std::string map = read_text(files.folder / "map.yaml");
  write_text(files.folder / "map.yaml", map.insert(map.rfind('}'), ", optional: true"));
  const Ended at_register = files.run("register");
  EXPECT_EQ(at_register.code, 0) << at_register.output << at_register.errors;
}

TEST(DeadDevicesInRealTime, RegisterThatStopsIsNamed) {
  const UnitFolder files("realtime", "max_age: 400 ms", "python3, unit.py, \"{modbus.plc}\", '2', '1'");
  const Ended dead = files.run("out");
  EXPECT_EQ(dead.code, 1) << dead.output << dead.errors;
  EXPECT_NE(reason_of(dead, files.folder / "out").find("register modbus.plc.level was not fresh on "),
            std::string::npos)
      << dead.output;
}

TEST_P(DeadDevices, FaultsOfAUnitExcuseItsRegisters) {
  for (const char* const fault : {"state: silent", "state: disconnected", "exception: 6", "delay: 2 s"}) {
    const UnitFolder files(GetParam(), "max_age: 400 ms, timeout: 200 ms",
                           "python3, unit.py, \"{modbus.plc}\", '99', '0'");
    write_text(files.folder / "f.yaml",
               "scenario: faulty\ninclude: [s.yaml]\n" +
                   fault_of(GetParam(), "device: modbus.plc, " + std::string(fault), 300));
    const Ended ended = run_hil({"run", files.folder / "f.yaml", "--out", files.folder / "out"});
    EXPECT_EQ(ended.code, 0) << fault << "\n" << ended.output << ended.errors;
  }
}

TEST_P(DeadDevices, ShortDelayOfAUnitDoesNotExcuseADeadRegister) {
  const UnitFolder files(GetParam(), "max_age: 400 ms, timeout: 200 ms",
                         "python3, unit.py, \"{modbus.plc}\", '2', '0'");
  write_text(files.folder / "f.yaml", "scenario: slow\ninclude: [s.yaml]\n" +
                                          fault_of(GetParam(), "device: modbus.plc, delay: 30 ms", 0));
  const Ended ended = run_hil({"run", files.folder / "f.yaml", "--out", files.folder / "out"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_EQ(reason_of(ended, files.folder / "out"),
            "no value of register modbus.plc.level came; 'optional: true' permits that");
}

TEST(DeadDevicesInRealTime, RegisterThatNoClientWritesIsNamed) {
  const UnitFolder files("realtime", "role: server", "python3, client.py, \"{modbus.plc}\", '0'");
  const Ended dead = files.run("out");
  EXPECT_EQ(dead.code, 1) << dead.output << dead.errors;
  EXPECT_EQ(reason_of(dead, files.folder / "out"),
            "no value of register modbus.plc.level came; 'optional: true' permits that");
  const Ended written = files.run("written", {"--set",
                                              "processes.plc.command=[python3, client.py, "
                                              "\"{modbus.plc}\", '0,2']"});
  EXPECT_EQ(written.code, 0) << written.output << written.errors;
}

// ---- Signals

constexpr const char* parts_database =
    "VERSION \"\"\nBU_: A B\n"
    "BO_ 512 Rep: 4 A\n SG_ Mux M : 0|8@1+ (1,0) [0|255] \"\" B\n SG_ P m0 : 8|8@1+ (1,0) [0|255] \"\" B\n"
    " SG_ Q m1 : 8|8@1+ (1,0) [0|255] \"\" B\n SG_ Last : 24|8@1+ (1,0) [0|255] \"\" B\n";

/// A station that sends Rep every 10 ms. Its second argument lists bytes with the milliseconds from which on
/// they are sent; the newest two of the list alternate.
constexpr const char* parts_station = R"(import sys, socket, struct
TIME, FRAME = struct.Struct("=IIQqQ"), struct.Struct("=IB3x8s")
hub = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
hub.connect(sys.argv[1][5:])
hub.send(struct.pack("=II56s", 0x484C4948, 1, b"station"))
frames = [(int(ms), bytes.fromhex(data)) for ms, data in (one.split(":") for one in sys.argv[2].split(","))]
sent = 0
try:
    while True:
        packet = hub.recv(128)
        if packet == b"": break
        if len(packet) != TIME.size: continue
        magic, kind, number, now, _ = TIME.unpack(packet)
        if kind != 2: continue
        if now % 10_000_000 == 0:
            current = [data for ms, data in frames if ms <= now / 1e6][-2:]
            data = current[sent % len(current)]
            sent += 1
            hub.send(FRAME.pack(0x200, len(data), data.ljust(8, b"\0")))
        hub.send(TIME.pack(magic, 3, number, now, 0))
except (ConnectionResetError, BrokenPipeError): pass
)";

/// `reader`: reads a signal.
struct PartsFolder : ScenarioFolder {
  PartsFolder(const std::string& frames, const std::string& reader)
      : ScenarioFolder(scenario_of("virtual",
                                   "can:\n  - bus: car\n    database: bus.dbc\n    rate: 100 Hz\n"
                                   "    receive: [{message: Rep, timeout: 30 ms}]\n"
                                   "processes:\n  ecu: {command: [python3, station.py, \"{can.car}\", '" +
                                       frames + "']}\n" + reader)) {
    write_text(folder / "bus.dbc", parts_database);
    write_text(folder / "station.py", parts_station);
  }
};

std::string block_of(const std::string& signal) {
  return "tasks:\n  - {module: plant, type: block, rate: 100 Hz, inputs: {v: " + signal +
         "}, parameters: {inputs: {v: '1'}, outputs: {y: 2 * v}}}\n";
}

TEST(MissingSignals, SignalThatSomethingReadsAndThatDoesNotComeFailsTheRun) {
  const std::string claim = "expectations: [{name: c, never: SIGNAL > 300, coverage: 1 %}]\n";
  const std::string variable = "variables: {x: 2 * SIGNAL}\n";
  const std::string table = variable + "expectations: [{name: c, never: x > 900, coverage: 1 %}]\n";
  const std::string stimulus =
      "tasks:\n  - {module: plant, type: block, rate: 100 Hz, parameters: {inputs: {v: '1'}, outputs: {y: "
      "v}}}\n"
      "stimuli: [{name: s, drives: plant.v, sequence: [{value: SIGNAL}]}]\n";
  const std::string faulted =
      block_of("SIGNAL") + "faults: [{name: f, signal: SIGNAL, offset: 1, at: 500 ms}]\n";
  struct Case {
    const char* frames;
    const char* signal;
    const char* failure;  ///< empty: it comes
  };
  for (const Case& one :
       {Case{"0:00010203", "Q", "no value of signal can.car.Rep.Q came"},
        {"0:00010203", "P", ""},
        {"0:00010203,0:01010203", "Q", ""},
        {"0:0001", "Last", "no value of signal can.car.Rep.Last came"},
        {"0:00010203,100:0001,100:0001", "Last", "signal can.car.Rep.Last was not fresh on "},
        {"0:0001,700:00010203,700:00010203", "Last", ""},
        {"0:01010203,300:00010203,300:00010203", "Q", "signal can.car.Rep.Q was not fresh"}}) {
    for (std::string reader : {block_of("SIGNAL"), claim, table, stimulus, faulted}) {
      for (std::size_t at; (at = reader.find("SIGNAL")) != std::string::npos;)
        reader.replace(at, 6, std::string("can.car.Rep.") + one.signal);
      const PartsFolder files(one.frames, reader);
      const Ended ended = files.run("out");
      ASSERT_TRUE(std::filesystem::exists(files.folder / "out/report.json")) << reader << ended.errors;
      const auto report = read_report(files.folder / "out");
      const bool fails = one.failure[0] != '\0';
      ASSERT_EQ(report["input_failures"].size(), fails ? 1U : 0U)
          << reader << ended.output << ended.errors << report["input_failures"];
      if (fails) {
        EXPECT_EQ(ended.code, 1) << reader << ended.output;
        EXPECT_EQ(report["input_failures"][0].get<std::string>().find(one.failure), 0U)
            << report["input_failures"];
      }
      files.run("optional", {"--set", "can.car.receive.Rep.optional=true"});
      EXPECT_TRUE(read_report(files.folder / "optional")["input_failures"].empty()) << reader;
    }
    const PartsFolder unread(
        one.frames, "plots: [{title: unread, signals: [can.car.Rep." + std::string(one.signal) + "]}]\n");
    const Ended ended = unread.run("out");
    EXPECT_EQ(ended.code, 0) << one.signal << ended.output << ended.errors;
  }
}

/// Frames that a fault takes show only of their own signals that the device sends them.
TEST(MissingSignals, FaultExcusesOnlyTheSignalsOfItsFrames) {
  for (const char* const fault : {"drop: 40 %", "length: 3", "delay: 25 ms", "flip_bits: [0]"}) {
    const std::string faults = "faults: [{name: f, message: can.car.Rep, " + std::string(fault) + "}]\n";
    const PartsFolder files("0:00010203", block_of("can.car.Rep.Q") + faults);
    const bool makes_q = fault[0] == 'f';
    EXPECT_EQ(files.run("out").code, makes_q ? 0 : 1) << fault;
    const PartsFolder right("0:00010203,0:01010203", block_of("can.car.Rep.Q") + faults);
    const Ended ended = right.run("out");
    EXPECT_EQ(ended.code, 0) << fault << ended.output << ended.errors;
    const PartsFolder last("0:00010203", block_of("can.car.Rep.Last") + faults);
    const Ended cut = last.run("out");
    EXPECT_EQ(cut.code, 0) << fault << cut.output << cut.errors;
  }
}

// ---- Rejected frames

/// Frames of Speed every 10 ms in the form of candump -l.
class RecordedSpeed {
 public:
  void add(int counter, bool has_right_checksum = true) {
    std::array<std::uint8_t, 8> bytes{static_cast<std::uint8_t>(counter),      0, 0, 0, 0, 0,
                                      static_cast<std::uint8_t>(counter & 15), 0};
    io::can::Crc8 crc;
    crc.add(0x00);  // the low byte of the identifier
    for (const std::uint8_t byte : bytes)
      crc.add(byte);
    bytes[7] = has_right_checksum ? crc.value() : static_cast<std::uint8_t>(crc.value() ^ 0x5A);
    char line[80];
    std::snprintf(line, sizeof line, "(%d.%06d) c 200#%02X0000000000%02X%02X\n", ms_ / 1000,
                  ms_ % 1000 * 1000, bytes[0], static_cast<unsigned>(bytes[6]),
                  static_cast<unsigned>(bytes[7]));
    text_ += line;
    ms_ += 10;
  }
  const std::string& text() const { return text_; }

 private:
  int ms_ = 0;
  std::string text_;
};

struct PlayedFolder : ScenarioFolder {
  explicit PlayedFolder(const std::string& log, const std::string& play = "{file: drive.log}",
                        const std::string& bus = {}, const std::string& more = {})
      : ScenarioFolder(scenario_of(
            "virtual",
            "can:\n  - bus: car\n    database: bus.dbc\n    rate: 500 Hz\n    play: " + play +
                "\n    receive: [{message: Speed, timeout: 50 ms, counter: Alive, checksum: CRC}]\n" + bus +
                more)) {
    write_text(folder / "bus.dbc", database);
    write_text(folder / "drive.log", log);
  }
};

nlohmann::json rejected(const ScenarioFolder& files, const std::string& out = "out") {
  const auto report = read_report(files.folder / out);
  EXPECT_EQ(report["can"][0]["inputs"].size(), 1U);
  const auto& rows = report["can"][0]["rejected"];
  return rows.empty() ? nlohmann::json({{"bad_checksum", 0}, {"bad_counter", 0}, {"by_scenario", 0}})
                      : rows[0];
}

TEST(RejectedFrames, WrongChecksumsFailBeyondMaxRejectedAndLeaveTheCounterAlone) {
  constexpr std::uint64_t seed = 74'062;
  std::mt19937_64 random(seed);
  for (int round = 0; round < 6; ++round) {
    RecordedSpeed log;
    std::uint64_t wrong = 0;
    for (int i = 0; i < 100; ++i) {
      const bool is_wrong = i > 0 && i < 95 && random() % 8 == 0;
      wrong += is_wrong ? 1 : 0;
      log.add(i, !is_wrong);
    }
    ASSERT_GT(wrong, 0U);
    const PlayedFolder files(log.text());
    const Ended ended = files.run("out");
    EXPECT_EQ(ended.code, 1) << "seed " << seed << "\n" << ended.output << ended.errors;
    EXPECT_NE(reason_of(ended, files.folder / "out").find(std::to_string(wrong) + " frame"),
              std::string::npos)
        << ended.output;
    const auto counts = rejected(files);
    EXPECT_EQ(counts["bad_checksum"], wrong) << "seed " << seed << ", round " << round;
    EXPECT_EQ(counts["bad_counter"], 0) << "seed " << seed << ", round " << round;
    EXPECT_EQ(counts["by_scenario"], 0);
    EXPECT_EQ(greatest(Signals(files.folder / "out")["can.car.Speed.rejected"]), static_cast<double>(wrong));
    const auto limit = [&](std::uint64_t count) {
      return files.run("limit", {"--set", "can.car.receive.Speed.max_rejected=" + std::to_string(count)})
          .code;
    };
    EXPECT_EQ(limit(wrong), 0);
    EXPECT_EQ(limit(wrong - 1), 1);
  }
}

TEST(RejectedFrames, GapOfTheCounterFailsTheRun) {
  RecordedSpeed log;
  for (int i = 0; i < 100; ++i)
    log.add(i < 50 ? i : i + 1);
  const PlayedFolder files(log.text());
  EXPECT_EQ(files.run("out").code, 1);
  EXPECT_EQ(rejected(files)["bad_counter"], 1);
  EXPECT_EQ(rejected(files)["by_scenario"], 0);
  for (const std::string skips : {"1", "5", "15"}) {
    const StationFolder station_files("virtual", "0-5000", {}, skips);
    const Ended ended = station_files.run("out");
    EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
    EXPECT_EQ(reason_of(ended, station_files.folder / "out"),
              "1 frame of message can.car.Speed was rejected for a wrong checksum, counter or format; "
              "max_rejected is 0");
  }
}

TEST(RejectedFrames, NewPassOfALogIsTheScenariosAndAGapInItIsNot) {
  for (const int frames : {1, 5, 16, 17, 21}) {
    RecordedSpeed log;
    for (int i = 0; i < frames; ++i)
      log.add(i);
    const PlayedFolder files(log.text(),
                             "{file: drive.log, repeat: 0, every: " + std::to_string(10 * frames) + " ms}");
    const Ended ended = files.run("out");
    EXPECT_EQ(ended.code, 0) << frames << "\n" << ended.output << ended.errors;
    const auto counts = rejected(files);
    EXPECT_EQ(counts["by_scenario"], counts["bad_counter"]) << frames;
    EXPECT_EQ(counts["bad_counter"] > 0, frames != 16) << frames << ": 16 counters are a whole cycle";
  }
  RecordedSpeed gap;
  for (int i = 0; i < 20; ++i)
    gap.add(i < 10 ? i : i + 3);
  const PlayedFolder files(gap.text(), "{file: drive.log, repeat: 3, every: 200 ms}");
  EXPECT_EQ(files.run("out").code, 1);
  const auto counts = rejected(files);
  EXPECT_EQ(counts["bad_counter"].get<int>() - counts["by_scenario"].get<int>(), 3) << counts;
  RecordedSpeed wrong_at_begin;
  for (int i = 0; i < 20; ++i)
    wrong_at_begin.add(i, i != 0);
  const PlayedFolder wrong(wrong_at_begin.text(), "{file: drive.log, repeat: 3, every: 200 ms}");
  EXPECT_EQ(wrong.run("out").code, 1) << "a new pass does not change a checksum";
}

TEST(RejectedFrames, FaultsOfTheMessageAreTheScenarios) {
  RecordedSpeed log;
  for (int i = 0; i < 100; ++i)
    log.add(i);
  for (const char* const fault :
       {"wrong: counter", "wrong: checksum", "drop: 100 %", "drop: 30 %", "delay: 45 ms", "repeat: 2",
        "length: 7", "length: 3", "flip_bits: [3, 51]", "stuck: last"}) {
    const PlayedFolder files(
        log.text(), "{file: drive.log}", {},
        "faults: [{name: f, message: can.car.Speed, " + std::string(fault) + ", at: 300 ms, for: 333 ms}]\n");
    const Ended ended = files.run("out");
    EXPECT_EQ(ended.code, 0) << fault << "\n" << ended.output << ended.errors;
    const auto counts = rejected(files);
    EXPECT_EQ(counts["by_scenario"].get<int>(),
              counts["bad_counter"].get<int>() + counts["bad_checksum"].get<int>())
        << fault << counts;
  }
}

TEST(RejectedFrames, WrongFrameBesideAFaultIsNotTheScenarios) {
  for (const int wrong : {10, 28, 70, 99}) {
    RecordedSpeed log;
    for (int i = 0; i < 100; ++i)
      log.add(i, i != wrong);
    const PlayedFolder files(log.text(), "{file: drive.log}", {},
                             "faults: [{name: f, message: can.car.Speed, wrong: checksum, at: 300 ms, for: "
                             "333 ms}]\n");
    EXPECT_EQ(files.run("out").code, 1) << wrong;
    const auto counts = rejected(files);
    EXPECT_EQ(counts["bad_checksum"].get<int>() - counts["by_scenario"].get<int>(), 1) << wrong << counts;
  }
}

/// Each rejected frame is the scenario's if it is right without the fault.
TEST(RejectedFrames, FaultExcusesOnlyTheFramesThatItMakesWrong) {
  constexpr std::uint64_t seed = 74'063;
  std::mt19937_64 random(seed);
  for (const char* const fault :
       {"delay: 5 ms", "delay: 45 ms", "stuck: last", "length: 7", "flip_bits: [3]"}) {
    for (const bool is_of_counter : {false, true}) {
      RecordedSpeed log;
      int wrong = 0, counter = 0;
      for (int i = 0; i < 90; ++i) {
        const bool is_wrong = i > 0 && random() % 6 == 0;
        wrong += is_wrong ? 1 : 0;
        if (is_wrong && is_of_counter) counter += static_cast<int>(1 + random() % 13);
        log.add(counter++, !is_wrong || is_of_counter);
      }
      const PlayedFolder files(
          log.text(), "{file: drive.log}", {},
          "faults: [{name: f, message: can.car.Speed, " + std::string(fault) + ", at: 0 s}]\n");
      const Ended ended = files.run("out");
      const auto counts = rejected(files);
      const int all = counts["bad_checksum"].get<int>() + counts["bad_counter"].get<int>();
      const bool makes_wrong = fault[0] == 'l' || fault[0] == 'f';
      const bool makes_right = fault[0] == 's' && !is_of_counter;  // the checksum of the stuck payload
      EXPECT_EQ(all, makes_wrong ? 90 : makes_right ? 0 : wrong) << fault << counts << ", seed " << seed;
      EXPECT_EQ(all - counts["by_scenario"].get<int>(), makes_right ? 0 : wrong)
          << fault << counts << ", seed " << seed;
      EXPECT_EQ(ended.code, makes_right ? 0 : 1) << fault << "\n" << ended.output << ended.errors;
    }
  }
}

TEST(RejectedFrames, DelayDoesNotExcuseADeviceWhoseFramesAreAllWrong) {
  RecordedSpeed log;
  for (int i = 0; i < 100; ++i)
    log.add(i, false);
  const std::string fault = "faults: [{name: f, message: can.car.Speed, delay: 2 ms, at: 0 s}]\n";
  const PlayedFolder files(log.text(), "{file: drive.log}", {}, fault);
  const Ended ended = files.run("out");
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_EQ(rejected(files)["by_scenario"], 0);
  EXPECT_EQ(read_report(files.folder / "out")["can"][0]["inputs"][0]["not_fresh"], 500)
      << "the fault silences nothing";
}

TEST(RejectedFrames, FaultsOfTheVirtualBusAreTheScenarios) {
  RecordedSpeed log;
  for (int i = 0; i < 100; ++i)
    log.add(i);
  for (const char* const faults : {"drop: 0.1", "corrupt: 0.1", "drop: 0.1, corrupt: 0.2, delay: 6 ms"}) {
    const PlayedFolder files(log.text(), "{file: drive.log}", "    faults: {" + std::string(faults) + "}\n");
    for (const char* const seed : {"1", "2", "3"}) {
      const Ended ended = files.run("out", {"--seed", seed});
      EXPECT_EQ(ended.code, 0) << faults << ", seed " << seed << "\n" << ended.output << ended.errors;
      EXPECT_GT(rejected(files)["by_scenario"], 0) << faults << ", seed " << seed;
    }
  }
}

TEST(RejectedFrames, BusOffKeepsValuesUntilTheirTimeOut) {
  RecordedSpeed log;
  for (int i = 0; i < 100; ++i)
    log.add(i);
  const std::string bus_off =
      "faults: [{name: off, device: can.car, state: bus_off, at: 301 ms, for: 200 ms}]\n";
  const PlayedFolder files(
      log.text(), "{file: drive.log}", {},
      bus_off +
          "expectations:\n"
          "  - {name: kept, always: can.car.Speed.V > 20, between: [302 ms, 350 ms], coverage: 100 %}\n"
          "  - {name: stale, always: can.car.Speed.fresh == 0, between: [354 ms, 500 ms]}\n"
          "  - {name: back, always: can.car.Speed.V > 20, between: [520 ms, 900 ms]}\n");
  const Ended ended = files.run("out");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  EXPECT_EQ(rejected(files)["bad_counter"], 0) << "any counter continues after the bus was off";
}

}  // namespace
}  // namespace hil::scenario_test
